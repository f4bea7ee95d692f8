#include "client_libs/cli/canvas.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "map/values/value_query.h"

namespace hypermap::cli {
namespace {

constexpr double kTextSize = 15.0;

int Pixels(double length) { return std::max(1, static_cast<int>(std::lround(length))); }

// FNV-1a with the last step of MurmurHash3, because without that the hashes of short words are
// close together. It is implemented here so that colours do not change with a library. The basis
// was chosen so that the usual objects of an office get distinct colours.
uint64_t Hash(absl::string_view text) {
  uint64_t hash = 2360;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  hash = (hash ^ (hash >> 33)) * 0xff51afd7ed558ccd;
  hash = (hash ^ (hash >> 33)) * 0xc4ceb9fe1a85ec53;
  return hash ^ (hash >> 33);
}

void SetSource(cairo_t* context, const Colour& c, double opacity = 1.0) {
  cairo_set_source_rgba(context, c.red, c.green, c.blue, opacity);
}

cairo_operator_t OperatorOf(Blend blend) {
  switch (blend) {
    case Blend::kOver:
      return CAIRO_OPERATOR_OVER;
    case Blend::kMultiply:
      return CAIRO_OPERATOR_MULTIPLY;
    case Blend::kMask:
      return CAIRO_OPERATOR_DEST_IN;
  }
  return CAIRO_OPERATOR_OVER;
}

// Returns the largest number <= `length` that is 1, 2 or 5 times a power of ten.
double RoundedDown(double length) {
  const double power = std::pow(10.0, std::floor(std::log10(length)));
  for (const double step : {5.0, 2.0}) {
    if (step * power <= length) return step * power;
  }
  return power;
}

}  // namespace

Colour Mix(const Colour& a, const Colour& b, double share) {
  const auto mix = [share](double x, double y) { return share * x + (1.0 - share) * y; };
  return {mix(a.red, b.red), mix(a.green, b.green), mix(a.blue, b.blue)};
}

Colour ColourOfLabel(absl::string_view label) {
  const uint64_t hash = Hash(FoldLabel(label));
  const double hue = static_cast<double>(hash & 0xFFFF) / 0x10000;
  // Three strengths distinguish classes of similar hue.
  constexpr std::pair<double, double> kDarkestAndBrightest[] = {
      {0.35, 0.9}, {0.15, 0.65}, {0.6, 0.95}};
  const auto& strength = kDarkestAndBrightest[(hash >> 16) % 3];
  const auto channel = [&](double offset) {
    const double turned = std::fmod(hue + offset, 1.0) * 6.0;
    const auto [darkest, brightest] = strength;
    return darkest + (brightest - darkest) * std::clamp(std::abs(turned - 3.0) - 1.0, 0.0, 1.0);
  };
  return {channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0)};
}

Plan::Plan(const Box& box, double pixels_per_m)
    : box_(box),
      pixels_per_m_(pixels_per_m),
      width_((box.max.x - box.min.x) * pixels_per_m),
      height_((box.max.y - box.min.y) * pixels_per_m) {}

double Plan::ScaleToFit(const Box& box, double longer_side) {
  return longer_side / std::max(box.max.x - box.min.x, box.max.y - box.min.y);
}

struct Canvas::Drawing {
  struct Deleter {
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
    void operator()(cairo_t* context) const { cairo_destroy(context); }
  };

  Drawing(cairo_format_t format, int width, int height)
      : surface(cairo_image_surface_create(format, width, height)),
        context(cairo_create(surface.get())) {}

  std::unique_ptr<cairo_surface_t, Deleter> surface;
  std::unique_ptr<cairo_t, Deleter> context;
};

Canvas::Canvas(std::unique_ptr<Drawing> drawing) : drawing_(std::move(drawing)) {
  cairo_select_font_face(drawing_->context.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(drawing_->context.get(), kTextSize);
}

Canvas::Canvas(double width, double height)
    : Canvas(std::make_unique<Drawing>(CAIRO_FORMAT_RGB24, Pixels(width), Pixels(height))) {
  SetSource(drawing_->context.get(), Grey(1.0));
  cairo_paint(drawing_->context.get());
}

Canvas::~Canvas() = default;

Canvas Canvas::Layer(const Canvas& below) {
  return Canvas(std::make_unique<Drawing>(CAIRO_FORMAT_ARGB32, below.width(), below.height()));
}

int Canvas::width() const { return cairo_image_surface_get_width(drawing_->surface.get()); }
int Canvas::height() const { return cairo_image_surface_get_height(drawing_->surface.get()); }

void Canvas::Fill(const Polygon& polygon, const Plan& plan, const Colour& c, double opacity) {
  Trace(polygon, plan);
  SetSource(drawing_->context.get(), c, opacity);
  cairo_set_fill_rule(drawing_->context.get(), CAIRO_FILL_RULE_EVEN_ODD);
  cairo_fill(drawing_->context.get());
}

void Canvas::Outline(const Polygon& polygon, const Plan& plan, const Colour& c, double width,
                     bool broken) {
  Trace(polygon, plan);
  Stroke(c, width, broken);
}

void Canvas::Line(const Point& from, const Point& to, const Colour& c, double width, bool broken) {
  cairo_move_to(drawing_->context.get(), from.x, from.y);
  cairo_line_to(drawing_->context.get(), to.x, to.y);
  Stroke(c, width, broken);
}

void Canvas::Path(const std::vector<Point>& points, const Plan& plan, const Colour& c,
                  double width) {
  for (const Point& p : points) {
    const Point at = plan.At(p);
    cairo_line_to(drawing_->context.get(), at.x, at.y);
  }
  cairo_set_line_join(drawing_->context.get(), CAIRO_LINE_JOIN_ROUND);
  Stroke(c, width, false);
  cairo_set_line_join(drawing_->context.get(), CAIRO_LINE_JOIN_MITER);
}

void Canvas::Cross(const Point& at, double size, const Colour& c, double width) {
  Line({at.x - size, at.y - size}, {at.x + size, at.y + size}, c, width, false);
  Line({at.x - size, at.y + size}, {at.x + size, at.y - size}, c, width, false);
}

void Canvas::Disc(const Point& at, double radius, const Colour& c) {
  cairo_new_path(drawing_->context.get());
  cairo_arc(drawing_->context.get(), at.x, at.y, radius, 0.0, 2.0 * std::acos(-1.0));
  SetSource(drawing_->context.get(), c);
  cairo_fill(drawing_->context.get());
}

void Canvas::Square(const Point& at, double size, const Colour& c) {
  cairo_rectangle(drawing_->context.get(), at.x, at.y - size, size, size);
  SetSource(drawing_->context.get(), c);
  cairo_fill(drawing_->context.get());
}

void Canvas::Text(const Point& at, const std::string& text) {
  SetSource(drawing_->context.get(), kBlack);
  cairo_move_to(drawing_->context.get(), at.x, at.y);
  cairo_show_text(drawing_->context.get(), text.c_str());
}

double Canvas::TextWidth(const std::string& text) const {
  cairo_text_extents_t extents;
  cairo_text_extents(drawing_->context.get(), text.c_str(), &extents);
  return extents.x_advance;
}

void Canvas::Add(const Ring& corners, const Plan& plan, const Colour& c, double opacity) {
  Trace(corners, plan);
  SetSource(drawing_->context.get(), c, opacity);
  cairo_set_operator(drawing_->context.get(), CAIRO_OPERATOR_ADD);
  cairo_fill(drawing_->context.get());
  cairo_set_operator(drawing_->context.get(), CAIRO_OPERATOR_OVER);
}

void Canvas::Lay(const Canvas& upper, Blend blend) {
  cairo_surface_flush(upper.drawing_->surface.get());
  cairo_set_source_surface(drawing_->context.get(), upper.drawing_->surface.get(), 0, 0);
  cairo_set_operator(drawing_->context.get(), OperatorOf(blend));
  cairo_paint(drawing_->context.get());
  cairo_set_operator(drawing_->context.get(), CAIRO_OPERATOR_OVER);
}

void Canvas::ClipTo(const Plan& plan) {
  cairo_rectangle(drawing_->context.get(), kMargin, kMargin, plan.width(), plan.height());
  cairo_clip(drawing_->context.get());
}

void Canvas::Unclip() { cairo_reset_clip(drawing_->context.get()); }

absl::StatusOr<std::string> Canvas::Png() const {
  std::string png;
  const auto append = [](void* target, const unsigned char* data, unsigned int size) {
    static_cast<std::string*>(target)->append(reinterpret_cast<const char*>(data), size);
    return CAIRO_STATUS_SUCCESS;
  };
  cairo_status_t status = cairo_status(drawing_->context.get());
  if (status == CAIRO_STATUS_SUCCESS) {
    status = cairo_surface_write_to_png_stream(drawing_->surface.get(), append, &png);
  }
  if (status == CAIRO_STATUS_SUCCESS) return png;
  return absl::InternalError(absl::StrCat("drawing: ", cairo_status_to_string(status)));
}

void Canvas::Trace(const Ring& ring, const Plan& plan) {
  for (const Point& p : ring) {
    const Point at = plan.At(p);
    cairo_line_to(drawing_->context.get(), at.x, at.y);
  }
  cairo_close_path(drawing_->context.get());
}

void Canvas::Trace(const Polygon& polygon, const Plan& plan) {
  for (const Ring& ring : polygon.rings()) {
    cairo_new_sub_path(drawing_->context.get());
    Trace(ring, plan);
  }
}

void Canvas::Stroke(const Colour& c, double width, bool broken) {
  // Lengths of dash and gap of a broken line, which grow with its width.
  const double dashes[] = {std::max(4.0, 3.0 * width), std::max(3.0, 2.0 * width)};
  cairo_set_dash(drawing_->context.get(), dashes, broken ? 2 : 0, 0.0);
  cairo_set_line_width(drawing_->context.get(), width);
  SetSource(drawing_->context.get(), c);
  cairo_stroke(drawing_->context.get());
}

void DrawScaleBar(Canvas& canvas, const Plan& plan) {
  constexpr double kLongest = 200.0, kTick = 4.0;
  const double length_m = RoundedDown(std::min(kLongest, plan.width()) / plan.pixels_per_m());
  const double left = kMargin, right = left + length_m * plan.pixels_per_m();
  const double y = kMargin + plan.height() + kFooter / 2;
  canvas.Line({left, y}, {right, y}, kBlack, 2.0, false);
  canvas.Line({left, y - kTick}, {left, y + kTick}, kBlack, 2.0, false);
  canvas.Line({right, y - kTick}, {right, y + kTick}, kBlack, 2.0, false);
  canvas.Text({right + 8, y + 5}, absl::StrCat(length_m, " m"));
}

void Legend::Text(const std::string& text) {
  canvas_.Text({x_, y_}, text);
  y_ += kLineHeight;
}

void Legend::Square(const Colour& c, const std::string& text) {
  constexpr double kSize = 14.0;
  canvas_.Square({x_ - 1, y_ + 1}, kSize + 2, Mix(c, kBlack, 0.5));
  canvas_.Square({x_, y_}, kSize, c);
  TextBehind(text);
}

void Legend::Line(const Colour& c, bool broken, const std::string& text) {
  canvas_.Line({x_, y_ - 4}, {x_ + 20, y_ - 4}, c, 1.2, broken);
  TextBehind(text);
}

void Legend::Cross(const Colour& c, const std::string& text) {
  canvas_.Cross({x_ + 10, y_ - 4}, 5.0, c);
  TextBehind(text);
}

void Legend::Sample(const std::function<void(Canvas& canvas, const Point& at)>& draw,
                    const std::string& text) {
  draw(canvas_, {x_, y_});
  TextBehind(text);
}

void Legend::TextBehind(const std::string& text) {
  canvas_.Text({x_ + kIndent, y_}, text);
  y_ += kLineHeight;
}

}  // namespace hypermap::cli
