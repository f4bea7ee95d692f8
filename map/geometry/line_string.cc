#include "map/geometry/line_string.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "map/geometry/coordinates.h"

namespace hypermap {

LineString::LineString(std::vector<Point> vertices) : vertices_(std::move(vertices)) {
  for (const Point& p : vertices_) bounds_.Extend(p);
}

absl::StatusOr<LineString> LineString::Make(std::vector<Point> vertices) {
  HYPERMAP_RETURN_IF_ERROR(CheckVertices("vertices", vertices));
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  if (vertices.size() < 2) {
    return absl::InvalidArgumentError("line string has fewer than 2 distinct vertices");
  }
  return LineString(std::move(vertices));
}

LineString LineString::MakeUnchecked(std::vector<Point> vertices) {
  return LineString(std::move(vertices));
}

double Length(const LineString& line) {
  const std::vector<Point>& vertices = line.vertices();
  double length = 0.0;
  for (size_t i = 1; i < vertices.size(); ++i) {
    length += std::hypot(vertices[i].x - vertices[i - 1].x, vertices[i].y - vertices[i - 1].y);
  }
  return length;
}

Point Centroid(const LineString& line) {
  if (line.empty()) return {};
  const std::vector<Point>& vertices = line.vertices();
  // Relative to the first vertex, so that short lines far from the origin do not lose their digits.
  const Point& reference = vertices.front();
  double length = 0.0, x = 0.0, y = 0.0;
  for (size_t i = 1; i < vertices.size(); ++i) {
    const Point a{vertices[i - 1].x - reference.x, vertices[i - 1].y - reference.y};
    const Point b{vertices[i].x - reference.x, vertices[i].y - reference.y};
    const double piece = std::hypot(b.x - a.x, b.y - a.y);
    length += piece;
    x += piece * (a.x + b.x) / 2;
    y += piece * (a.y + b.y) / 2;
  }
  // Rotation may round close vertices to the same point, which leaves no length.
  if (length == 0.0) return reference;
  return {reference.x + x / length, reference.y + y / length};
}

}  // namespace hypermap
