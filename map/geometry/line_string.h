// Connected straight segments, such as a lane or the line of a wall.
//
// Invariant of a LineString made by Make: at least two vertices, all within 1e9 m of the origin
// along each axis, and none equal to the one before it. It may be closed, and may cross or touch
// itself. Vertices keep their order and exact coordinates. An immutable value; safe to read from
// many threads.
#ifndef HYPERMAP_MAP_GEOMETRY_LINE_STRING_H_
#define HYPERMAP_MAP_GEOMETRY_LINE_STRING_H_

#include <vector>

#include "absl/status/statusor.h"
#include "map/geometry/point.h"

namespace hypermap {

class LineString {
 public:
  // The empty line string has no vertices and covers nothing.
  LineString() = default;

  // Validates the vertices, and drops vertices that repeat the one before. INVALID_ARGUMENT names
  // the vertex (0-based, as given) that is wrong, or says that fewer than two are distinct.
  static absl::StatusOr<LineString> Make(std::vector<Point> vertices);

  // For vertices known to satisfy the invariant, such as those read from a store or moved rigidly.
  static LineString MakeUnchecked(std::vector<Point> vertices);

  bool empty() const { return vertices_.empty(); }
  const std::vector<Point>& vertices() const { return vertices_; }
  const Box& bounds() const { return bounds_; }

  friend bool operator==(const LineString& a, const LineString& b) {
    return a.vertices_ == b.vertices_;
  }

 private:
  explicit LineString(std::vector<Point> vertices);

  std::vector<Point> vertices_;
  Box bounds_;
};

// Length in metres; 0 for the empty line string.
double Length(const LineString& line);

// The mean of the segments' midpoints, weighted by length; the origin for the empty line string.
Point Centroid(const LineString& line);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_LINE_STRING_H_
