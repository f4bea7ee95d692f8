// The footprint of an object on the floor plane.
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
  // Points below this height above the plane are floor, metres.
  float floor_m = 0.03f;
  // Points farther from the camera than this are left out, metres.
  float max_range_m = 8.0f;
  // An object with fewer points has no footprint.
  int min_points = 8;
};

struct Footprint {
  Polygon hull;  // Convex, in the frame of the pose.
  CellPatch cells;
  HeightRange height;
  int num_points = 0;
  double range_m = 0.0;  // Mean distance from the camera.
};

// Returns the footprint of the cloud's `pixels` (ascending). Depth is first smoothed among
// neighbours on the same surface, and isolated points are left out. Cells are 1 cm wide for objects
// narrower than 0.45 m, otherwise 2.5 cm. Returns nullopt if too few points are left, or if they
// lie on one line.
std::optional<Footprint> MakeFootprint(const OrganisedCloud& cloud,
                                       const std::vector<int32_t>& pixels,
                                       const FootprintOptions& options);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_FOOTPRINT_H_
