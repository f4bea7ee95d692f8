#include "client_libs/cli/map_image.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "base/status/status_macros.h"
#include "client_libs/cli/canvas.h"
#include "client_libs/cli/map_legend.h"
#include "client_libs/cli/map_style.h"

namespace hypermap::cli {
namespace {

constexpr double kMostOpaque = 0.85;  // opacity of a polygon whose existence is certain

// The colour of a cell; nullopt if it is not drawn.
std::optional<Colour> ColourOfCell(const GridScene& grid, const std::optional<double>& value) {
  const bool is_floor = grid.style == GridStyle::kFloor;
  if (!value.has_value()) return is_floor ? std::optional(kUnknown) : std::nullopt;
  const double share = grid.ShareOf(*value);
  switch (grid.style) {
    case GridStyle::kFloor:
      return Mix(kOccupied, kFree, share);
    case GridStyle::kShade:
      return share > 0.0 ? kBright : kDarkened;
    case GridStyle::kTint:
      return Mix(kHighest, kLowest, share);
  }
  return std::nullopt;
}

// Draws the grids of a scene on a canvas, one over the other.
class GridPainter {
 public:
  GridPainter(const MapScene& scene, const ReadCells& read_cells, const Plan& plan, Canvas& canvas)
      : scene_(scene),
        read_cells_(read_cells),
        plan_(plan),
        canvas_(canvas),
        needs_floor_(!scene.explorations.empty()),
        floor_(needs_floor_ ? Canvas::Layer(canvas) : Canvas(1, 1)) {
    floor_.ClipTo(plan);
  }

  // Floors are drawn before the grids that darken or tint them.
  absl::Status Paint() {
    for (const bool below : {true, false}) {
      for (const GridScene& grid : scene_.grids) {
        if ((grid.style == GridStyle::kFloor) != below) continue;
        HYPERMAP_RETURN_IF_ERROR(Paint(grid));
      }
    }
    return absl::OkStatus();
  }

 private:
  absl::Status Paint(const GridScene& grid) {
    Canvas cells = Canvas::Layer(canvas_);
    cells.ClipTo(plan_);
    const bool is_floor = grid.style == GridStyle::kFloor;
    absl::Status status =
        read_cells_(grid.layer, [&](const GridGeometry& geometry, const CellRun& run) {
          const std::optional<Colour> colour = ColourOfCell(grid, run.value);
          if (!colour.has_value()) return;
          const Ring corners = CornersOf(run, geometry);
          cells.Add(corners, plan_, *colour);
          if (needs_floor_ && is_floor && run.value.has_value()) {
            floor_.Add(corners, plan_, kBlack, 1.0 - grid.ShareOf(*run.value));
          }
        });
    const std::vector<const Polygon*> areas = AreasExploredOn(grid.layer);
    if (areas.empty()) {
      canvas_.Lay(cells, is_floor ? Blend::kOver : Blend::kMultiply);
    } else {
      Canvas shade = Canvas::Layer(canvas_);
      DrawUnexplored(areas, shade);
      shade.Lay(cells, Blend::kOver);
      canvas_.Lay(shade, Blend::kMultiply);
    }
    return status;
  }

  std::vector<const Polygon*> AreasExploredOn(const std::string& layer) const {
    std::vector<const Polygon*> areas;
    for (const ExplorationScene& exploration : scene_.explorations) {
      if (exploration.layer == layer) areas.push_back(&exploration.area);
    }
    return areas;
  }

  // Draws all floor as unexplored; explored cells are drawn over it.
  void DrawUnexplored(const std::vector<const Polygon*>& areas, Canvas& shade) const {
    shade.Fill(Polygon::FromBox(scene_.box), plan_, kNotToExplore, 1.0);
    for (const Polygon* area : areas) shade.Fill(*area, plan_, kDarkened, 1.0);
    shade.Lay(floor_, Blend::kMask);
  }

  const MapScene& scene_;
  const ReadCells& read_cells_;
  const Plan& plan_;
  Canvas& canvas_;
  const bool needs_floor_;
  Canvas floor_;  // opaque where the floors are free
};

void DrawObject(Canvas& canvas, const Plan& plan, const DrawnObject& object) {
  const Colour colour = ColourOfLabel(object.label);
  switch (object.shape.kind()) {
    case ShapeKind::kPolygon:
      canvas.Fill(object.shape.polygon(), plan, colour, kMostOpaque * object.existence);
      canvas.Outline(object.shape.polygon(), plan, Mix(colour, kBlack, 0.4), 1.0, false);
      break;
    case ShapeKind::kLineString:
      DrawLineObject(canvas, object.shape.line_string(), plan, colour, object.existence);
      break;
    case ShapeKind::kPoint:
      DrawPointObject(canvas, plan.At(object.shape.point()), colour, object.existence);
      break;
  }
}

// Line strings and points have no area, so they are drawn last, points over lines.
void DrawObjects(Canvas& canvas, const Plan& plan, const std::vector<DrawnObject>& objects) {
  const auto size_of = [](const DrawnObject& object) {
    return std::pair(Area(object.shape), Length(object.shape));
  };
  for (const DrawnObject* object : LargestFirst(objects, size_of)) {
    DrawObject(canvas, plan, *object);
  }
}

void DrawExplorations(Canvas& canvas, const Plan& plan, const MapScene& scene,
                      const RobotColours& robots) {
  for (const ExplorationScene& exploration : scene.explorations) {
    DrawExplorationBorder(canvas, exploration.area, plan);
  }
  for (const RobotPath& path : scene.paths) DrawPath(canvas, path, plan, robots.Of(path.robot));
  for (const Point& place : scene.unreachable_places) DrawUnreachablePlace(canvas, plan.At(place));
  for (const GoalMarker& goal : scene.goals) {
    DrawGoal(canvas, plan.At(goal.at), robots.Of(goal.robot));
  }
  for (const RobotPath& path : scene.paths) {
    DrawPathEnd(canvas, plan.At(path.points.back()), robots.Of(path.robot));
  }
}

}  // namespace

absl::StatusOr<MapImage> DrawMap(const MapScene& scene, const ReadCells& read_cells) {
  const Plan plan(scene.box, scene.pixels_per_m);
  const RobotColours robots(scene);
  const MapLegend legend(scene, robots, plan);
  Canvas canvas(plan.width() + legend.width() + 2 * kMargin,
                std::max(plan.height() + kFooter, legend.height()) + 2 * kMargin);
  HYPERMAP_RETURN_IF_ERROR(GridPainter(scene, read_cells, plan, canvas).Paint());
  canvas.ClipTo(plan);
  DrawObjects(canvas, plan, scene.objects);
  DrawExplorations(canvas, plan, scene, robots);
  canvas.Unclip();
  if (scene.area.has_value()) canvas.Outline(*scene.area, plan, kAreaBorder, 2.0, false);
  legend.Draw(canvas, {2 * kMargin + plan.width(), kMargin});
  DrawScaleBar(canvas, plan);
  HYPERMAP_ASSIGN_OR_RETURN(std::string png, canvas.Png());
  return MapImage{std::move(png), canvas.width(), canvas.height()};
}

}  // namespace hypermap::cli
