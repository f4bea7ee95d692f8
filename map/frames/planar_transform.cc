#include "map/frames/planar_transform.h"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace hypermap {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Normalises to (-pi, pi]; values in that range are returned unchanged, to the last bit.
double NormalizedYaw(double yaw) {
  const double turned = std::remainder(yaw, 2.0 * kPi);
  return turned <= -kPi ? kPi : turned;
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
