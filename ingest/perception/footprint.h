// The points of a thing on the plane.
#ifndef HYPERMAP_INGEST_PERCEPTION_FOOTPRINT_H_
#define HYPERMAP_INGEST_PERCEPTION_FOOTPRINT_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "ingest/perception/organised_cloud.h"
#include "map/geometry/polygon.h"
#include "map/grid/grid_geometry.h"
#include "map/objects/semantic_object.h"
#include "map/observations/observation.h"

namespace hypermap::ingest {

struct FootprintOptions {
  // Points lower above the plane are floor, metres.
  float floor_m = 0.03f;
  // Points farther from the camera are left out, metres.
  float max_range_m = 8.0f;
  int min_points = 8;
};

struct Footprint {
  Polygon hull;  // in the frame of the pose
  CellPatch cells;
  HeightRange height;
  int num_points = 0;
  double range_m = 0.0;  // mean distance from the camera
};

// Of the `pixels` (ascending) of the cloud. Depth is smoothed among neighbours of the same surface
// first; lone points are left out. Cells are 1 cm wide for things narrower than 0.45 m, else
// 2.5 cm. nullopt when too few points are left, or they lie on one line.
std::optional<Footprint> MakeFootprint(const OrganisedCloud& cloud,
                                       const std::vector<int32_t>& pixels,
                                       const FootprintOptions& options);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_FOOTPRINT_H_
