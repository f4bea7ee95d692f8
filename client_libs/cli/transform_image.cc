#include "client_libs/cli/transform_image.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/map_style.h"
#include "map/query/query.h"

namespace hypermap::cli {
namespace {

constexpr double kPlanSize = 1600.0;     // the longer side of the plan, pixels
constexpr double kSourceOpacity = 0.75;  // so that walls of the target show through
constexpr double kTargetOpacity = 0.3;   // of its objects
constexpr double kRoomAround_m = 0.5;

const PlanarTransform kNoTransform;

Box BoxOf(const TransformSideScene& side, const PlanarTransform& target_from_side) {
  Box box;
  if (side.grid) {
    const GridGeometry grid = GeometryInFrame(*side.grid, target_from_side);
    for (const CellRun& run : side.runs) {
      if (!run.value) continue;
      for (const Point& corner : CornersOf(run, grid)) box.Extend(corner);
    }
  }
  for (const Shape& shape : side.shapes) box.Extend((target_from_side * shape).bounds());
  return box;
}

// All content, with room for line strings and points, which may have no extent.
absl::StatusOr<Box> BoxOf(const TransformScene& scene) {
  Box box = BoxOf(scene.target, kNoTransform);
  const Box source = BoxOf(scene.source, scene.target_from_source);
  if (!source.empty()) box.Extend(source);
  for (const TransformPairScene& pair : scene.pairs) {
    box.Extend(pair.target);
    box.Extend(scene.target_from_source * pair.source);
  }
  if (box.empty()) return absl::FailedPreconditionError("there is nothing to draw");
  return Box{{box.min.x - kRoomAround_m, box.min.y - kRoomAround_m},
             {box.max.x + kRoomAround_m, box.max.y + kRoomAround_m}};
}

void DrawTarget(Canvas& canvas, const Plan& plan, const TransformSideScene& side) {
  if (side.grid) {
    Canvas cells = Canvas::Layer(canvas);
    cells.ClipTo(plan);
    for (const CellRun& run : side.runs) {
      if (!run.value) continue;
      const double occupied = std::clamp(*run.value, 0.0, 1.0);
      cells.Add(CornersOf(run, *side.grid), plan, Mix(kTargetColour, kFree, occupied));
    }
    canvas.Lay(cells, Blend::kOver);
  }
  for (const Shape& shape : side.shapes) {
    if (shape.is_polygon()) {
      canvas.Fill(shape.polygon(), plan, kTargetColour, kTargetOpacity);
      canvas.Outline(shape.polygon(), plan, kTargetColour, 1.0, false);
    } else if (shape.kind() == ShapeKind::kLineString) {
      DrawLineObject(canvas, shape.line_string(), plan, kTargetColour, 1.0);
    } else {
      DrawPointObject(canvas, plan.At(shape.point()), kTargetColour, 1.0);
    }
  }
}

void DrawSource(Canvas& canvas, const Plan& plan, const TransformSideScene& side,
                const PlanarTransform& target_from_source) {
  if (side.grid) {
    const GridGeometry grid = GeometryInFrame(*side.grid, target_from_source);
    Canvas cells = Canvas::Layer(canvas);
    cells.ClipTo(plan);
    for (const CellRun& run : side.runs) {
      cells.Add(CornersOf(run, grid), plan, kSourceColour, kSourceOpacity);
    }
    canvas.Lay(cells, Blend::kOver);
  }
  for (const Shape& shape : side.shapes) {
    const Shape laid = target_from_source * shape;
    if (laid.is_polygon()) {
      canvas.Outline(laid.polygon(), plan, kSourceColour, 1.8, false);
    } else if (laid.kind() == ShapeKind::kLineString) {
      DrawLineObject(canvas, laid.line_string(), plan, kSourceColour, 1.0);
    } else {
      DrawPointObject(canvas, plan.At(laid.point()), kSourceColour, 1.0);
    }
  }
}

void DrawPairs(Canvas& canvas, const Plan& plan, const TransformScene& scene) {
  for (const TransformPairScene& pair : scene.pairs) {
    const Point source = plan.At(scene.target_from_source * pair.source);
    const Point target = plan.At(pair.target);
    if (!pair.agrees) canvas.Line(source, target, kSourceColour, 1.2, /*broken=*/true);
    canvas.Disc(target, 5.0, kTargetColour);
    canvas.Cross(source, 6.0, kSourceColour, 2.0);
  }
}

// The texts of the legend beside their samples.
double LegendWidth(const TransformScene& scene) {
  const Canvas measure(1, 1);
  double widest =
      std::max(measure.TextWidth(scene.source.name), measure.TextWidth(scene.target.name));
  for (const std::string& note : scene.notes) widest = std::max(widest, measure.TextWidth(note));
  return widest + Legend::kIndent + kMargin;
}

}  // namespace

absl::StatusOr<MapImage> DrawTransform(const TransformScene& scene) {
  HYPERMAP_ASSIGN_OR_RETURN(const Box box, BoxOf(scene));
  const Plan plan(box, Plan::ScaleToFit(box, kPlanSize));
  const double legend_height = static_cast<double>(4 + scene.notes.size()) * kLineHeight;
  Canvas canvas(plan.width() + LegendWidth(scene) + 2 * kMargin,
                std::max(plan.height() + kFooter, legend_height) + 2 * kMargin);
  canvas.ClipTo(plan);
  DrawTarget(canvas, plan, scene.target);
  DrawSource(canvas, plan, scene.source, scene.target_from_source);
  DrawPairs(canvas, plan, scene);
  canvas.Unclip();
  Legend legend(canvas, {2 * kMargin + plan.width(), kMargin});
  legend.Square(kTargetColour, scene.target.name);
  legend.Square(kSourceColour, scene.source.name);
  legend.Gap();
  for (const std::string& note : scene.notes) legend.Text(note);
  DrawScaleBar(canvas, plan);
  HYPERMAP_ASSIGN_OR_RETURN(std::string png, canvas.Png());
  return MapImage{std::move(png), canvas.width(), canvas.height()};
}

}  // namespace hypermap::cli
