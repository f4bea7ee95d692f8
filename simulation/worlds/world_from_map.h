// Builds a world in two and a half dimensions from the layers of a map.
#ifndef HYPERMAP_SIMULATION_WORLDS_WORLD_FROM_MAP_H_
#define HYPERMAP_SIMULATION_WORLDS_WORLD_FROM_MAP_H_

#include <vector>

#include "map/exploration/floor_plan.h"
#include "map/objects/semantic_object.h"
#include "simulation/worlds/scene.h"

namespace hypermap::simulation {

inline constexpr double kWallHeight_m = 2.5;

// Makes a wall of each cell that is not free, and a body of each object with a polygon: its convex
// hull, extruded over the object's own heights, or over those of its class (HeightOfClass) where it
// has none. An object without heights that lies in one that carries others (a cup in a table)
// stands on it. There is no wall where an object stands, because an occupancy layer shows furniture
// as well. Bodies are in the order of `objects`; line strings, points and empty polygons are left
// out. All coordinates are in the frame of `geometry`.
Scene WorldFromMap(const FloorPlan& plan, const GridGeometry& geometry,
                   const std::vector<SemanticObject>& objects);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_WORLD_FROM_MAP_H_
