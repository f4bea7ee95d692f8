#include "simulation/worlds/world_from_map.h"

#include <algorithm>
#include <utility>

#include "map/geometry/convex_hull.h"
#include "map/geometry/predicates.h"
#include "map/grid/cell_cover.h"
#include "simulation/worlds/class_heights.h"

namespace hypermap::simulation {
namespace {

// Returns the height of the surface that `object` stands on: the upper end of the highest object
// that may carry others and contains its centroid, or 0, the floor.
double HeightBelow(const SemanticObject& object, const std::vector<SemanticObject>& objects) {
  const Point middle = Centroid(object.shape);
  double below = 0.0;
  for (const SemanticObject& other : objects) {
    if (&other == &object || !other.shape.is_polygon()) continue;
    const ClassHeight height = HeightOfClass(other.label);
    if (!height.carries || !Covers(other.shape, middle)) continue;
    below = std::max(below, other.height ? other.height->high_m : height.height_m);
  }
  return below;
}

HeightRange HeightOf(const SemanticObject& object, const std::vector<SemanticObject>& objects) {
  if (object.height && object.height->high_m > object.height->low_m) return *object.height;
  const ClassHeight height = HeightOfClass(object.label);
  // Objects that may carry others stand on the floor themselves.
  const double low_m = height.above_m > 0.0 ? height.above_m
                       : height.carries     ? 0.0
                                            : HeightBelow(object, objects);
  return {low_m, low_m + height.height_m};
}

// Sets those cells to free that the rule selects and that are `what` in the plan.
void Free(const Polygon& footprint, CellRule rule, Floor what, const GridGeometry& geometry,
          FloorPlan* plan) {
  const CellCover cover(footprint, geometry, plan->box(), rule);
  for (int32_t row = cover.bounds().row_begin; row < cover.bounds().row_end; ++row) {
    for (const ColumnSpan& span : cover.SpansOfRow(row)) {
      for (int32_t col = span.col_begin; col < span.col_end; ++col) {
        if (plan->at({row, col}) == what) plan->set({row, col}, Floor::kFree);
      }
    }
  }
}

// Removes the walls where the object stands. A laser draws furniture slightly too large, so that
// all occupied cells that the footprint touches are freed. Unknown cells are freed only if their
// centres are covered.
void ClearWalls(const Polygon& footprint, const GridGeometry& geometry, FloorPlan* plan) {
  Free(footprint, CellRule::kTouched, Floor::kOccupied, geometry, plan);
  Free(footprint, CellRule::kCentre, Floor::kUnknown, geometry, plan);
}

}  // namespace

Scene WorldFromMap(const FloorPlan& plan, const GridGeometry& geometry,
                   const std::vector<SemanticObject>& objects) {
  Scene scene;
  scene.bounds = geometry.BoundsOf(plan.box());
  FloorPlan walls = plan;
  for (const SemanticObject& object : objects) {
    // Lanes, docks and other lines and points are no obstacles.
    if (!object.shape.is_polygon() || object.shape.empty()) continue;
    const Polygon hull = ConvexHull(object.shape.polygon().outer());
    if (hull.empty()) continue;
    const HeightRange height = HeightOf(object, objects);
    scene.bodies.push_back({object.label, {{hull.outer(), height.low_m, height.high_m}}});
    ClearWalls(hull, geometry, &walls);
  }
  scene.walls.emplace(std::move(walls), geometry, kWallHeight_m);
  return scene;
}

}  // namespace hypermap::simulation
