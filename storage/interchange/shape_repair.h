// Rings from recorded files made into valid polygons, or a clear word why not.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_SHAPE_REPAIR_H_
#define HYPERMAP_STORAGE_INTERCHANGE_SHAPE_REPAIR_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/geometry/polygon.h"

namespace hypermap::storage {

struct RepairedShape {
  // None when the rings enclose no area; several when a crossing ring encloses areas apart.
  std::vector<Polygon> polygons;
  std::vector<std::string> repairs;
};

// Filling takes time with the crossings. A whole import may spend so many.
inline constexpr int64_t kMaxCrossingsPerImport = 20'000;

// `rings`: the outer one first, finite. A ring without holes that crosses itself is filled by the
// non-zero winding rule; a hole without area is left out. A ring's crossings beyond the few that
// recorded hulls have are taken off `crossings_left`; RESOURCE_EXHAUSTED when they run out.
// INVALID_ARGUMENT for other faults of polygons with holes.
absl::StatusOr<RepairedShape> RepairShape(std::vector<Ring> rings, int64_t& crossings_left);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_SHAPE_REPAIR_H_
