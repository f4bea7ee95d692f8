// The shape of an object: a polygon, a line string or a point.
//
//   Shape room = *Polygon::Make({{0, 0}, {4, 0}, {4, 3}, {0, 3}});
//   Shape lane = *LineString::Make({{0, 1}, {8, 1}});
//   Shape dock = *Shape::MakePoint({2.5, 1});
//   if (lane.kind() == ShapeKind::kLineString) Draw(lane.line_string().vertices());
//
// A shape is a closed set: the boundary of a polygon and both ends of a line string belong to it.
// An immutable value; safe to read from many threads. Predicates are in map/geometry/predicates.h.
#ifndef HYPERMAP_MAP_GEOMETRY_SHAPE_H_
#define HYPERMAP_MAP_GEOMETRY_SHAPE_H_

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <utility>
#include <variant>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/geometry/line_string.h"
#include "map/geometry/point.h"
#include "map/geometry/polygon.h"

namespace hypermap {

// In the order of Shape's alternatives.
enum class ShapeKind : uint8_t { kPolygon, kLineString, kPoint };

inline constexpr ShapeKind kAllShapeKinds[] = {ShapeKind::kPolygon, ShapeKind::kLineString,
                                               ShapeKind::kPoint};

// Returns "polygon", "line_string" or "point".
absl::string_view ShapeKindName(ShapeKind kind);
std::optional<ShapeKind> ParseShapeKind(absl::string_view name);

// A set of kinds; by default all of them.
class ShapeKinds {
 public:
  ShapeKinds() = default;
  ShapeKinds(std::initializer_list<ShapeKind> kinds) : bits_(0) {
    for (const ShapeKind kind : kinds) Add(kind);
  }

  void Add(ShapeKind kind) { bits_ |= Bit(kind); }
  bool Contains(ShapeKind kind) const { return (bits_ & Bit(kind)) != 0; }
  bool ContainsAll() const { return *this == ShapeKinds(); }
  bool empty() const { return bits_ == 0; }

  friend bool operator==(const ShapeKinds&, const ShapeKinds&) = default;

 private:
  static uint8_t Bit(ShapeKind kind) { return uint8_t{1} << static_cast<int>(kind); }

  uint8_t bits_ = 0b111;
};

class Shape {
 public:
  // The empty polygon, which covers nothing.
  Shape() = default;
  // Implicit, so that polygons and line strings can be passed as shapes.
  Shape(Polygon polygon) : shape_(std::move(polygon)) {}  // NOLINT(google-explicit-constructor)
  Shape(LineString line) : shape_(std::move(line)) {}     // NOLINT(google-explicit-constructor)

  // INVALID_ARGUMENT if a coordinate is not finite or farther than 1e9 m from the origin.
  static absl::StatusOr<Shape> MakePoint(const Point& point);
  // For a point known to be valid.
  static Shape MakePointUnchecked(const Point& point) { return Shape(point); }

  ShapeKind kind() const { return static_cast<ShapeKind>(shape_.index()); }
  bool is_polygon() const { return kind() == ShapeKind::kPolygon; }
  // REQUIRES: the shape is of that kind.
  const Polygon& polygon() const { return *std::get_if<Polygon>(&shape_); }
  const LineString& line_string() const { return *std::get_if<LineString>(&shape_); }
  const Point& point() const { return *std::get_if<Point>(&shape_); }

  // Calls `visitor` with the Polygon, LineString or Point, and returns the result.
  template <typename Visitor>
  decltype(auto) Visit(Visitor&& visitor) const {
    return std::visit(std::forward<Visitor>(visitor), shape_);
  }

  // Returns whether it has no vertices.
  bool empty() const {
    switch (kind()) {
      case ShapeKind::kPolygon:
        return polygon().empty();
      case ShapeKind::kLineString:
        return line_string().empty();
      case ShapeKind::kPoint:
        break;
    }
    return false;
  }
  // The smallest box around it; for a point, a box without extent.
  Box bounds() const {
    switch (kind()) {
      case ShapeKind::kPolygon:
        return polygon().bounds();
      case ShapeKind::kLineString:
        return line_string().bounds();
      case ShapeKind::kPoint:
        break;
    }
    return {point(), point()};
  }
  int num_vertices() const;
  // Returns one of the vertices. REQUIRES: not empty.
  const Point& any_vertex() const;

  friend bool operator==(const Shape&, const Shape&) = default;

 private:
  explicit Shape(const Point& point) : shape_(point) {}

  std::variant<Polygon, LineString, Point> shape_;
};

// Area in square metres; 0 for lines and points.
double Area(const Shape& shape);
// Length in metres: of a line string from end to end, of a polygon along all its rings; 0 for a
// point.
double Length(const Shape& shape);
// The centre of a polygon's area or of a line string's length; for a point, the point itself.
Point Centroid(const Shape& shape);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_SHAPE_H_
