// Makes valid polygons of the rings in recorded files.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_SHAPE_REPAIR_H_
#define HYPERMAP_STORAGE_INTERCHANGE_SHAPE_REPAIR_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/geometry/polygon.h"

namespace hypermap::storage {

struct RepairedShape {
  // None when the rings enclose no area; several when a ring that crosses itself encloses separate
  // areas.
  std::vector<Polygon> polygons;
  std::vector<std::string> repairs;
};

// Limit of crossings in a whole import: filling a ring takes time with the number of its crossings.
inline constexpr int64_t kMaxCrossingsPerImport = 20'000;

// Repairs a polygon given by its rings, the outer one first. A ring without holes that crosses
// itself is filled by the non-zero winding rule; a hole without area is left out. Each ring has a
// few crossings free, as recorded hulls have; the others are subtracted from `crossings_left`.
// RESOURCE_EXHAUSTED when none are left; INVALID_ARGUMENT for other faults of polygons with holes.
// REQUIRES: vertices are finite.
absl::StatusOr<RepairedShape> RepairShape(std::vector<Ring> rings, int64_t& crossings_left);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_SHAPE_REPAIR_H_
