#include "client_libs/cli/eval_image.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client_libs/cli/canvas.h"

namespace hypermap::cli {
namespace {

constexpr double kPlanSize = 1200.0;  // the longer side of the plan, pixels
constexpr double kLegendWidth = 260.0;
constexpr Colour kMissed{0.0, 0.25, 0.9};
constexpr Colour kUnpaired{0.85, 0.0, 0.0};

// A box around all polygons with a margin of half a metre. One metre wide if there are none.
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
  std::vector<bool> detected(truth.size(), false), paired(map.size(), false);
  for (const evaluation::Pair& pair : evaluation.pairs) {
    detected[pair.truth] = true;
    paired[pair.map] = true;
  }
  const auto area_of = [](const evaluation::Object& object) { return Area(object.polygon); };
  for (const evaluation::Object* object : LargestFirst(map, area_of)) {
    canvas.Fill(object->polygon, plan, ColourOfLabel(object->label), 0.7);
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
  Legend legend(canvas, {2 * kMargin + plan.width(), kMargin});
  legend.Text(absl::StrFormat("F1 %.2f   PQ %.2f   IoU %.2f", e.f1, e.pq, e.mean_iou));
  legend.Text(absl::StrCat(e.duplicates, " duplicate, ", e.spurious, " spurious"));
  legend.Gap();
  legend.Line(kBlack, false, "truth, found");
  legend.Line(kMissed, true, "truth, missed");
  legend.Cross(kUnpaired, "map, not true");
  legend.Gap();
  for (const evaluation::ClassScore& score : e.per_class) {
    legend.Square(ColourOfLabel(score.label),
                  absl::StrCat(score.label, "  ", score.detected, "/", score.truth));
  }
}

}  // namespace

absl::StatusOr<std::string> DrawEvaluation(const std::vector<evaluation::Object>& truth,
                                           const std::vector<evaluation::Object>& map,
                                           const evaluation::Evaluation& evaluation) {
  const Box box = BoxOf(truth, map);
  const Plan plan(box, Plan::ScaleToFit(box, kPlanSize));
  const double legend_height = (8 + static_cast<double>(evaluation.per_class.size())) * kLineHeight;
  Canvas canvas(plan.width() + kLegendWidth + 2 * kMargin,
                std::max(plan.height() + kFooter, legend_height) + 2 * kMargin);
  DrawObjects(canvas, plan, truth, map, evaluation);
  DrawLegend(canvas, plan, evaluation);
  DrawScaleBar(canvas, plan);
  return canvas.Png();
}

}  // namespace hypermap::cli
