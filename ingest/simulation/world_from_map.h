// The world that a map describes, in two and a half dimensions.
#ifndef HYPERMAP_INGEST_SIMULATION_WORLD_FROM_MAP_H_
#define HYPERMAP_INGEST_SIMULATION_WORLD_FROM_MAP_H_

#include <vector>

#include "ingest/simulation/scene.h"
#include "map/exploration/floor_plan.h"
#include "map/layers/semantic_object.h"

namespace hypermap::simulation {

inline constexpr double kWallHeight_m = 2.5;

// Cells that are not free stand up as walls. An object is the convex hull of its polygon, drawn up
// over the heights that it has, else over those of its class (HeightOfClass); what of these lies in
// a thing that carries others stands on it. Where an object stands there is no wall: an occupancy
// layer has furniture as well. Bodies are in the order of `objects`, those without an area left
// out. All in the frame of `geometry`.
Scene WorldFromMap(const FloorPlan& plan, const GridGeometry& geometry,
                   const std::vector<SemanticObject>& objects);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_INGEST_SIMULATION_WORLD_FROM_MAP_H_
