#include "map/frames/planar_transform.h"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
#include "base/status/status_macros.h"

namespace hypermap {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Normalises to (-pi, pi]; values in that range are returned unchanged, to the last bit.
double NormalizedYaw(double yaw) {
  const double turned = std::remainder(yaw, 2.0 * kPi);
  return turned <= -kPi ? kPi : turned;
}

absl::Status CheckMoved(const Shape& shape) {
  switch (shape.kind()) {
    case ShapeKind::kPolygon: {
      const Rings& rings = shape.polygon().rings();
      for (size_t i = 0; i < rings.size(); ++i) {
        HYPERMAP_RETURN_IF_ERROR(
            CheckVertices(i == 0 ? "outer" : absl::StrCat("holes[", i - 1, "]"), rings[i]));
      }
      return absl::OkStatus();
    }
    case ShapeKind::kLineString:
      return CheckVertices("vertices", shape.line_string().vertices());
    case ShapeKind::kPoint:
      return Shape::MakePoint(shape.point()).status();
  }
  return absl::OkStatus();
}

}  // namespace

PlanarTransform::PlanarTransform(double x, double y, double yaw)
    : isometry_(Eigen::Isometry2d::Identity()), yaw_(NormalizedYaw(yaw)) {
  isometry_.translation() = Eigen::Vector2d(x, y);
  if (yaw_ != 0.0) isometry_.linear() = Eigen::Rotation2Dd(yaw_).toRotationMatrix();
}

PlanarTransform PlanarTransform::Inverse() const {
  // Subtracting from 0 avoids negative zeros.
  if (yaw_ == 0.0) return PlanarTransform(0.0 - x(), 0.0 - y(), 0.0);
  const Point origin = ApplyInverse({0.0, 0.0});
  return PlanarTransform(origin.x, origin.y, -yaw_);
}

Eigen::Isometry3d PlanarTransform::InSpace() const {
  Eigen::Isometry3d spatial = Eigen::Isometry3d::Identity();
  spatial.translate(Eigen::Vector3d(x(), y(), 0.0));
  spatial.rotate(Eigen::AngleAxisd(yaw_, Eigen::Vector3d::UnitZ()));
  return spatial;
}

Point PlanarTransform::ApplyInverse(const Point& p) const {
  const Eigen::Vector2d from_origin(p.x - x(), p.y - y());
  if (yaw_ == 0.0) return {from_origin.x(), from_origin.y()};
  const Eigen::Vector2d turned = isometry_.linear().transpose() * from_origin;
  return {turned.x(), turned.y()};
}

Point PlanarTransform::operator*(const Point& p) const {
  if (yaw_ == 0.0) return {x() + p.x, y() + p.y};
  const Eigen::Vector2d moved = isometry_ * Eigen::Vector2d(p.x, p.y);
  return {moved.x(), moved.y()};
}

Polygon PlanarTransform::operator*(const Polygon& polygon) const {
  if (IsIdentity()) return polygon;
  Rings rings = polygon.rings();
  for (Ring& ring : rings) {
    for (Point& p : ring) p = *this * p;
  }
  return Polygon::MakeUnchecked(std::move(rings));
}

Shape PlanarTransform::operator*(const Shape& shape) const {
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      return *this * shape.polygon();
    case ShapeKind::kLineString: {
      std::vector<Point> vertices = shape.line_string().vertices();
      for (Point& p : vertices) p = *this * p;
      return LineString::MakeUnchecked(std::move(vertices));
    }
    case ShapeKind::kPoint:
      break;
  }
  return Shape::MakePointUnchecked(*this * shape.point());
}

PlanarTransform PlanarTransform::operator*(const PlanarTransform& other) const {
  const Point origin = *this * Point{other.x(), other.y()};
  return PlanarTransform(origin.x, origin.y, yaw_ + other.yaw_);
}

bool IsWithinBounds(const PlanarTransform& t) {
  // The comparisons are false for NaN.
  return std::abs(t.x()) <= kMaxCoordinate_m && std::abs(t.y()) <= kMaxCoordinate_m;
}

absl::Status CheckTranslation(absl::string_view field, const PlanarTransform& t) {
  if (IsWithinBounds(t)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, ": x or y is more than ", kMaxCoordinate_m, " m"));
}

absl::StatusOr<Shape> Moved(const PlanarTransform& t, const Shape& shape) {
  if (t.IsIdentity()) return shape;
  Shape moved = t * shape;
  HYPERMAP_RETURN_IF_ERROR(CheckMoved(moved));
  // A ring that winds the other way is not read from a store as it was written.
  if (!moved.is_polygon() || !RunsBackwards(moved.polygon().rings())) return moved;
  const Rings& rings = moved.polygon().rings();
  return Polygon::Make(rings.front(), std::vector<Ring>(rings.begin() + 1, rings.end()));
}

Box BoundsOf(const PlanarTransform& t, const Box& box) {
  Box bounds;
  if (box.empty()) return bounds;
  for (const Point& corner :
       {box.min, box.max, Point{box.min.x, box.max.y}, Point{box.max.x, box.min.y}}) {
    const Point moved = t * corner;
    bounds.Extend(moved);
    if (t.yaw() == 0.0) continue;
    const double rounding =
        4.0 * std::numeric_limits<double>::epsilon() *
        (std::abs(corner.x) + std::abs(corner.y) + std::abs(t.x()) + std::abs(t.y()));
    bounds.Extend(Point{moved.x - rounding, moved.y - rounding});
    bounds.Extend(Point{moved.x + rounding, moved.y + rounding});
  }
  return bounds;
}

}  // namespace hypermap
