// Makes valid polygons from rings in recorded files.
#ifndef HYPERMAP_MAP_GEOMETRY_REPAIR_H_
#define HYPERMAP_MAP_GEOMETRY_REPAIR_H_

#include <vector>

#include "absl/status/statusor.h"
#include "map/geometry/polygon.h"

namespace hypermap {

// Returns the region around which `ring` winds at least once in either direction, as polygons with
// disjoint interiors, the largest first. (This is the non-zero winding rule: recorded hulls may
// wind several times.) A ring that is a valid polygon is returned as that polygon, with its own
// vertices. INVALID_ARGUMENT if a vertex is not finite, fewer than three are distinct, or no area
// is enclosed. Errors of CheckCancelled.
absl::StatusOr<std::vector<Polygon>> FillNonZero(const Ring& ring);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_REPAIR_H_
