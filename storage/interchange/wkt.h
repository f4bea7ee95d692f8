// Polygons as well-known text, read as leniently as the original's files need it.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_WKT_H_
#define HYPERMAP_STORAGE_INTERCHANGE_WKT_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/geometry/polygon.h"

namespace hypermap::storage {

// What a text says, before anything is asked of its geometry.
struct WktShape {
  // The polygons' rings as they are written, the outer one first, without the closing vertex. A
  // polygon without rings is EMPTY.
  std::vector<std::vector<Ring>> polygons;
  // What was not as the format has it; vertices count from 1.
  std::vector<std::string> repairs;
};

// POLYGON and MULTIPOLYGON, in any case, with any blanks; rings closed or open; `x y x y` where a
// comma is missing; a comment after the last parenthesis. INVALID_ARGUMENT naming the place for
// everything else; RESOURCE_EXHAUSTED for a polygon of more than `max_vertices`.
absl::StatusOr<WktShape> ParseWkt(absl::string_view text, int max_vertices);

// POLYGON with closed rings, every coordinate as the shortest decimal that reads back as itself.
std::string FormatWkt(const Polygon& polygon);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_WKT_H_
