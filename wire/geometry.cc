#include "wire/geometry.h"

#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "wire/field.h"

namespace hypermap::wire {
namespace {

void EncodeRing(const Ring& ring, v1::Ring* message) {
  message->mutable_points()->Reserve(static_cast<int>(ring.size()));
  for (const Point& p : ring) EncodePoint(p, message->add_points());
}

absl::StatusOr<Ring> DecodeRing(absl::string_view polygon_field, absl::string_view ring_name,
                                const v1::Ring& message) {
  Ring ring;
  ring.reserve(message.points_size());
  for (const v1::Point& vertex : message.points()) {
    const Point p{vertex.x(), vertex.y()};
    if (!IsFinite(p)) {
      return InvalidField(absl::StrCat(polygon_field, ".", ring_name, ".points[", ring.size(), "]"),
                          "is not finite");
    }
    ring.push_back(p);
  }
  return ring;
}

// The outer ring first.
absl::StatusOr<Rings> DecodeRings(absl::string_view field, const v1::Polygon& message) {
  if (!message.has_outer()) return InvalidField(absl::StrCat(field, ".outer"), "is missing");
  Rings rings;
  rings.reserve(1 + message.holes_size());
  absl::StatusOr<Ring> outer = DecodeRing(field, "outer", message.outer());
  if (!outer.ok()) return outer.status();
  rings.push_back(*std::move(outer));
  for (const v1::Ring& hole : message.holes()) {
    absl::StatusOr<Ring> ring =
        DecodeRing(field, absl::StrCat("holes[", rings.size() - 1, "]"), hole);
    if (!ring.ok()) return ring.status();
    rings.push_back(*std::move(ring));
  }
  return rings;
}

absl::Status CheckVertices(absl::string_view field, const v1::Polygon& message,
                           const DecodeLimits& limits) {
  int64_t vertices = message.outer().points_size();
  for (const v1::Ring& hole : message.holes()) vertices += hole.points_size();
  if (vertices <= limits.max_vertices) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat(field, " has ", vertices, " vertices, --max_vertices is ", limits.max_vertices));
}

}  // namespace

void EncodePoint(const Point& p, v1::Point* message) {
  message->set_x(p.x);
  message->set_y(p.y);
}

void EncodePolygon(const Polygon& polygon, v1::Polygon* message) {
  const Rings& rings = polygon.rings();
  for (size_t i = 0; i < rings.size(); ++i) {
    EncodeRing(rings[i], i == 0 ? message->mutable_outer() : message->add_holes());
  }
}

void EncodePose(const PlanarTransform& pose, v1::Pose* message) {
  message->set_x(pose.x());
  message->set_y(pose.y());
  message->set_yaw(pose.yaw());
}

void EncodeTransform(const FrameTransform& transform, v1::Transform* message) {
  message->set_parent_frame_id(transform.parent_frame_id);
  message->set_child_frame_id(transform.child_frame_id);
  EncodePose(transform.parent_from_child, message->mutable_parent_from_child());
}

absl::StatusOr<Point> DecodePoint(absl::string_view field, const v1::Point& message) {
  const Point p{message.x(), message.y()};
  if (!IsFinite(p)) return InvalidField(field, "is not finite");
  return p;
}

absl::StatusOr<PlanarTransform> DecodePose(absl::string_view field, const v1::Pose& message) {
  if (!std::isfinite(message.x()) || !std::isfinite(message.y()) || !std::isfinite(message.yaw())) {
    return InvalidField(field, "is not finite");
  }
  return PlanarTransform(message.x(), message.y(), message.yaw());
}

absl::StatusOr<FrameTransform> DecodeTransform(absl::string_view field,
                                               const v1::Transform& message) {
  const std::string pose_field = absl::StrCat(field, ".parent_from_child");
  if (!message.has_parent_from_child()) return InvalidField(pose_field, "is missing");
  const absl::StatusOr<PlanarTransform> pose = DecodePose(pose_field, message.parent_from_child());
  if (!pose.ok()) return pose.status();
  return FrameTransform{message.parent_frame_id(), message.child_frame_id(), *pose};
}

absl::StatusOr<Polygon> DecodePolygon(absl::string_view field, const v1::Polygon& message,
                                      const DecodeLimits& limits) {
  if (absl::Status status = CheckVertices(field, message, limits); !status.ok()) return status;
  absl::StatusOr<Rings> rings = DecodeRings(field, message);
  if (!rings.ok()) return rings.status();
  std::vector<Ring> holes(std::make_move_iterator(rings->begin() + 1),
                          std::make_move_iterator(rings->end()));
  absl::StatusOr<Polygon> polygon = Polygon::Make(std::move(rings->front()), std::move(holes));
  if (!polygon.ok()) return InField(field, polygon.status());
  return polygon;
}

absl::StatusOr<Polygon> DecodePolygon(absl::string_view field, const v1::Polygon& message) {
  absl::StatusOr<Rings> rings = DecodeRings(field, message);
  if (!rings.ok()) return rings.status();
  for (const Ring& ring : *rings) {
    if (ring.size() < 3) return InvalidField(field, "has a ring of fewer than 3 vertices");
  }
  return Polygon::MakeUnchecked(*std::move(rings));
}

}  // namespace hypermap::wire
