#include "client_libs/cli/eval_image.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "map/values/value_query.h"

namespace hypermap::cli {
namespace {

constexpr double kPlanSize = 1200.0;  // the longer side of the plan, pixels
constexpr double kLegendWidth = 260.0;
constexpr double kMargin = 20.0;
constexpr double kLineHeight = 18.0;
constexpr double kTextSize = 13.0;

struct Colour {
  double red = 0.0;
  double green = 0.0;
  double blue = 0.0;
};
constexpr Colour kBlack{0.1, 0.1, 0.1};
constexpr Colour kMissed{0.0, 0.25, 0.9};
constexpr Colour kUnpaired{0.85, 0.0, 0.0};

// Hues a golden angle apart: neighbours in the list look different, however many there are.
Colour ColourOf(int index) {
  const auto channel = [index](double offset) {
    const double hue = std::fmod(index * 0.381966 + offset, 1.0) * 6.0;
    return 0.35 + 0.55 * std::clamp(std::abs(hue - 3.0) - 1.0, 0.0, 1.0);
  };
  return {channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0)};
}

struct Deleter {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};

// The plane in pixels: `box` fitted into the plan, y upwards.
class Plan {
 public:
  explicit Plan(const Box& box) : box_(box) {
    const double width = box.max.x - box.min.x, height = box.max.y - box.min.y;
    pixels_per_m_ = kPlanSize / std::max(width, height);
    width_ = width * pixels_per_m_;
    height_ = height * pixels_per_m_;
  }
  double width() const { return width_; }
  double height() const { return height_; }
  double pixels_per_m() const { return pixels_per_m_; }
  Point At(const Point& p) const {
    return {kMargin + (p.x - box_.min.x) * pixels_per_m_,
            kMargin + (box_.max.y - p.y) * pixels_per_m_};
  }

 private:
  Box box_;
  double pixels_per_m_ = 1.0;
  double width_ = 0.0;
  double height_ = 0.0;
};

// Draws on a surface that it owns.
class Canvas {
 public:
  Canvas(double width, double height)
      : surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, std::lround(width),
                                            std::lround(height))),
        context_(cairo_create(surface_.get())) {
    cairo_set_source_rgb(context_.get(), 1, 1, 1);
    cairo_paint(context_.get());
    cairo_set_font_size(context_.get(), kTextSize);
  }

  void Fill(const Polygon& polygon, const Plan& plan, const Colour& c, double opacity) {
    Trace(polygon, plan);
    cairo_set_source_rgba(context_.get(), c.red, c.green, c.blue, opacity);
    cairo_set_fill_rule(context_.get(), CAIRO_FILL_RULE_EVEN_ODD);
    cairo_fill(context_.get());
  }

  void Outline(const Polygon& polygon, const Plan& plan, const Colour& c, double width,
               bool broken) {
    Trace(polygon, plan);
    Stroke(c, width, broken);
  }

  void Line(const Point& from, const Point& to, const Colour& c, double width, bool broken) {
    cairo_move_to(context_.get(), from.x, from.y);
    cairo_line_to(context_.get(), to.x, to.y);
    Stroke(c, width, broken);
  }

  void Cross(const Point& at, double size, const Colour& c) {
    Line({at.x - size, at.y - size}, {at.x + size, at.y + size}, c, 1.5, false);
    Line({at.x - size, at.y + size}, {at.x + size, at.y - size}, c, 1.5, false);
  }

  void Square(const Point& at, double size, const Colour& c) {
    cairo_rectangle(context_.get(), at.x, at.y - size, size, size);
    cairo_set_source_rgb(context_.get(), c.red, c.green, c.blue);
    cairo_fill(context_.get());
  }

  void Text(const Point& at, const std::string& text) {
    cairo_set_source_rgb(context_.get(), kBlack.red, kBlack.green, kBlack.blue);
    cairo_move_to(context_.get(), at.x, at.y);
    cairo_show_text(context_.get(), text.c_str());
  }

  absl::StatusOr<std::string> Png() const {
    std::string png;
    const auto append = [](void* target, const unsigned char* data, unsigned int size) {
      static_cast<std::string*>(target)->append(reinterpret_cast<const char*>(data), size);
      return CAIRO_STATUS_SUCCESS;
    };
    cairo_status_t status = cairo_status(context_.get());
    if (status == CAIRO_STATUS_SUCCESS) {
      status = cairo_surface_write_to_png_stream(surface_.get(), append, &png);
    }
    if (status == CAIRO_STATUS_SUCCESS) return png;
    return absl::InternalError(absl::StrCat("drawing: ", cairo_status_to_string(status)));
  }

 private:
  void Trace(const Polygon& polygon, const Plan& plan) {
    for (const Ring& ring : polygon.rings()) {
      for (const Point& p : ring) {
        const Point at = plan.At(p);
        cairo_line_to(context_.get(), at.x, at.y);
      }
      cairo_close_path(context_.get());
    }
  }

  void Stroke(const Colour& c, double width, bool broken) {
    const double dashes[] = {4.0, 3.0};
    cairo_set_dash(context_.get(), dashes, broken ? 2 : 0, 0.0);
    cairo_set_line_width(context_.get(), width);
    cairo_set_source_rgb(context_.get(), c.red, c.green, c.blue);
    cairo_stroke(context_.get());
  }

  std::unique_ptr<cairo_surface_t, Deleter> surface_;
  std::unique_ptr<cairo_t, Deleter> context_;
};

// All polygons with half a metre around; a metre where there is nothing.
Box BoxOf(const std::vector<evaluation::Object>& truth,
          const std::vector<evaluation::Object>& map) {
  Box box;
  for (const auto* objects : {&truth, &map}) {
    for (const evaluation::Object& object : *objects) box.Extend(object.polygon.bounds());
  }
  if (box.empty()) box.Extend(Point{0.0, 0.0});
  constexpr double kAround = 0.5;
  return {{box.min.x - kAround, box.min.y - kAround}, {box.max.x + kAround, box.max.y + kAround}};
}

void DrawObjects(Canvas& canvas, const Plan& plan, const std::vector<evaluation::Object>& truth,
                 const std::vector<evaluation::Object>& map,
                 const evaluation::Evaluation& evaluation) {
  std::map<std::string, int> index_of;
  for (const evaluation::ClassScore& score : evaluation.per_class) {
    index_of.emplace(score.label, static_cast<int>(index_of.size()));
  }
  std::vector<bool> detected(truth.size(), false), paired(map.size(), false);
  for (const evaluation::Pair& pair : evaluation.pairs) {
    detected[pair.truth] = true;
    paired[pair.map] = true;
  }
  // Large ones first, so that what stands on a table is seen.
  std::vector<const evaluation::Object*> by_size;
  for (const evaluation::Object& object : map) by_size.push_back(&object);
  std::stable_sort(by_size.begin(), by_size.end(), [](const auto* a, const auto* b) {
    return Area(a->polygon) > Area(b->polygon);
  });
  for (const evaluation::Object* object : by_size) {
    canvas.Fill(object->polygon, plan, ColourOf(index_of[FoldLabel(object->label)]), 0.7);
  }
  for (size_t i = 0; i < truth.size(); ++i) {
    canvas.Outline(truth[i].polygon, plan, detected[i] ? kBlack : kMissed, 1.2, !detected[i]);
  }
  for (size_t i = 0; i < map.size(); ++i) {
    if (paired[i]) continue;
    canvas.Outline(map[i].polygon, plan, kUnpaired, 1.0, false);
    canvas.Cross(plan.At(Centroid(map[i].polygon)), 5.0, kUnpaired);
  }
}

void DrawLegend(Canvas& canvas, const Plan& plan, const evaluation::Evaluation& e) {
  const double x = 2 * kMargin + plan.width(), text_x = x + 28;
  double y = kMargin + kLineHeight;
  const auto next = [&y] { return std::exchange(y, y + kLineHeight); };
  canvas.Text({x, next()}, absl::StrFormat("F1 %.2f   PQ %.2f   IoU %.2f", e.f1, e.pq, e.mean_iou));
  canvas.Text({x, next()}, absl::StrCat(e.duplicates, " duplicate, ", e.spurious, " spurious"));
  y += kLineHeight / 2;
  canvas.Line({x, y - 4}, {x + 20, y - 4}, kBlack, 1.2, false);
  canvas.Text({text_x, next()}, "truth, found");
  canvas.Line({x, y - 4}, {x + 20, y - 4}, kMissed, 1.2, true);
  canvas.Text({text_x, next()}, "truth, missed");
  canvas.Cross({x + 10, y - 4}, 5.0, kUnpaired);
  canvas.Text({text_x, next()}, "map, not true");
  y += kLineHeight / 2;
  for (size_t i = 0; i < e.per_class.size(); ++i) {
    const evaluation::ClassScore& score = e.per_class[i];
    canvas.Square({x, y}, 12, ColourOf(static_cast<int>(i)));
    canvas.Text({text_x, next()},
                absl::StrCat(score.label, "  ", score.detected, "/", score.truth));
  }
  const double bottom = kMargin + plan.height() - 4;
  canvas.Line({kMargin, bottom}, {kMargin + plan.pixels_per_m(), bottom}, kBlack, 2.0, false);
  canvas.Text({kMargin, bottom - 6}, "1 m");
}

}  // namespace

absl::StatusOr<std::string> DrawEvaluation(const std::vector<evaluation::Object>& truth,
                                           const std::vector<evaluation::Object>& map,
                                           const evaluation::Evaluation& evaluation) {
  const Plan plan(BoxOf(truth, map));
  const double legend_height = (8 + static_cast<double>(evaluation.per_class.size())) * kLineHeight;
  Canvas canvas(plan.width() + kLegendWidth + 2 * kMargin,
                std::max(plan.height(), legend_height) + 2 * kMargin);
  DrawObjects(canvas, plan, truth, map, evaluation);
  DrawLegend(canvas, plan, evaluation);
  return canvas.Png();
}

}  // namespace hypermap::cli
