// Occupancy grids of plans that are drawn by functions.
#ifndef HYPERMAP_MAP_REGISTRATION_TESTING_DRAWN_PLAN_H_
#define HYPERMAP_MAP_REGISTRATION_TESTING_DRAWN_PLAN_H_

#include <functional>
#include <memory>
#include <optional>

#include "map/frames/planar_transform.h"
#include "map/geometry/point.h"
#include "map/layers/grid_layer.h"

namespace hypermap::registration::testing {

// The occupancy of each place, in metres; nullopt: unknown.
using Plan = std::function<std::optional<double>(const Point&)>;

// A room of 8 m x 5 m around the origin with walls of 0.1 m. Nothing is known outside.
std::optional<double> EmptyRoom(const Point& p);
// The room with a partition and a cabinet, so that it is like itself in one way only.
std::optional<double> FurnishedRoom(const Point& p);

// Returns a grid of the places of `plan` within `reach_m` of its origin along each axis, in a frame
// in which the plan lies at `grid_from_plan`.
std::shared_ptr<const GridLayer> Drawn(const Plan& plan, const PlanarTransform& grid_from_plan,
                                       double resolution_m, double reach_m);

}  // namespace hypermap::registration::testing

#endif  // HYPERMAP_MAP_REGISTRATION_TESTING_DRAWN_PLAN_H_
