// Polygons, line strings and points as well-known text (WKT), read as leniently as the files of the
// original Hypermap need it.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_WKT_H_
#define HYPERMAP_STORAGE_INTERCHANGE_WKT_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/geometry/shape.h"

namespace hypermap::storage {

// The content of a text, not yet validated: rings may cross and vertices may repeat.
struct WktShape {
  ShapeKind kind = ShapeKind::kPolygon;
  // The rings of each polygon of a POLYGON or MULTIPOLYGON as written, the outer one first, without
  // the closing vertex. A polygon without rings is EMPTY.
  std::vector<std::vector<Ring>> polygons;
  // The vertices of a LINESTRING as written, or the point of a POINT; none when it is EMPTY.
  std::vector<Point> vertices;
  // One line for each departure from the format; vertices count from 1.
  std::vector<std::string> repairs;
};

// Parses POLYGON, MULTIPOLYGON, LINESTRING or POINT in any case and with any blanks. Takes rings
// that are left open, `x y x y` where a comma is missing, and a comment after the last parenthesis.
// INVALID_ARGUMENT naming the place for everything else; RESOURCE_EXHAUSTED for a polygon or line
// string of more than `max_vertices`; errors of CheckCancelled.
absl::StatusOr<WktShape> ParseWkt(absl::string_view text, int max_vertices);

// Formats a shape as POLYGON with closed rings, LINESTRING or POINT. Coordinates are written as the
// shortest decimals that read back exactly. REQUIRES: the shape is not empty.
std::string FormatWkt(const Shape& shape);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_WKT_H_
