// Rings from recorded files made into valid polygons, or a clear word why not.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_SHAPE_REPAIR_H_
#define HYPERMAP_STORAGE_INTERCHANGE_SHAPE_REPAIR_H_

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

// `rings`: the outer one first, finite. A ring without holes that crosses itself is filled by the
// non-zero winding rule; a hole without area is left out. INVALID_ARGUMENT for other faults of
// polygons with holes, and for a ring that crosses itself so often that filling it would take
// longer than anyone could have meant.
absl::StatusOr<RepairedShape> RepairShape(std::vector<Ring> rings);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_SHAPE_REPAIR_H_
