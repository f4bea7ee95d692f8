#include "map/geometry/shape.h"

#include <cmath>

#include "base/status/status_macros.h"
#include "map/geometry/coordinates.h"

namespace hypermap {
namespace {

double Perimeter(const Polygon& polygon) {
  double length = 0.0;
  for (const Ring& ring : polygon.rings()) {
    Point a = ring.back();
    for (const Point& b : ring) {
      length += std::hypot(b.x - a.x, b.y - a.y);
      a = b;
    }
  }
  return length;
}

}  // namespace

absl::string_view ShapeKindName(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::kPolygon:
      return "polygon";
    case ShapeKind::kLineString:
      return "line_string";
    case ShapeKind::kPoint:
      return "point";
  }
  return "";
}

std::optional<ShapeKind> ParseShapeKind(absl::string_view name) {
  for (const ShapeKind kind : kAllShapeKinds) {
    if (name == ShapeKindName(kind)) return kind;
  }
  return std::nullopt;
}

absl::StatusOr<Shape> Shape::MakePoint(const Point& point) {
  if (!CheckVertices("", {point}).ok()) {
    return absl::InvalidArgumentError(IsFinite(point) ? "point is more than 1e+09 m from the origin"
                                                      : "point is not finite");
  }
  return Shape(point);
}

int Shape::num_vertices() const {
  switch (kind()) {
    case ShapeKind::kPolygon:
      return polygon().num_vertices();
    case ShapeKind::kLineString:
      return static_cast<int>(line_string().vertices().size());
    case ShapeKind::kPoint:
      return 1;
  }
  return 0;
}

const Point& Shape::any_vertex() const {
  switch (kind()) {
    case ShapeKind::kPolygon:
      return polygon().outer().front();
    case ShapeKind::kLineString:
      return line_string().vertices().front();
    case ShapeKind::kPoint:
      break;
  }
  return point();
}

double Area(const Shape& shape) { return shape.is_polygon() ? Area(shape.polygon()) : 0.0; }

double Length(const Shape& shape) {
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      return Perimeter(shape.polygon());
    case ShapeKind::kLineString:
      return Length(shape.line_string());
    case ShapeKind::kPoint:
      return 0.0;
  }
  return 0.0;
}

Point Centroid(const Shape& shape) {
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      return Centroid(shape.polygon());
    case ShapeKind::kLineString:
      return Centroid(shape.line_string());
    case ShapeKind::kPoint:
      break;
  }
  return shape.point();
}

}  // namespace hypermap
