// Makes valid polygons of rings as they are found in recorded files.
#ifndef HYPERMAP_MAP_GEOMETRY_REPAIR_H_
#define HYPERMAP_MAP_GEOMETRY_REPAIR_H_

#include <vector>

#include "absl/status/statusor.h"
#include "map/geometry/polygon.h"

namespace hypermap {

// The region that `ring` winds round at least once in either direction (non-zero winding rule, as
// hulls that go round several times are meant), as polygons whose interiors are apart, largest area
// first. A ring that already is a valid polygon comes back as that polygon with its own vertices.
// INVALID_ARGUMENT when a vertex is not finite, fewer than three are distinct, or nothing with an
// area is enclosed.
absl::StatusOr<std::vector<Polygon>> FillNonZero(const Ring& ring);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_REPAIR_H_
