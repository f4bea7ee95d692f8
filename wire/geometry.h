// Points, shapes, poses and transforms on the wire.
//
// In this folder Encode... fills a fresh message from a domain value, and Decode... makes a domain
// value of a message or says which field is wrong: `field` is the message's place in its request
// ("edits[3].put_object.object.shape"). What is decoded here without a limit is an answer: the
// server has validated it, so only its shape is looked at. All functions may be called from any
// thread.
#ifndef HYPERMAP_WIRE_GEOMETRY_H_
#define HYPERMAP_WIRE_GEOMETRY_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/geometry.pb.h"
#include "map/frames/frame_tree.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/polygon.h"
#include "map/geometry/shape.h"
#include "wire/limits.h"

namespace hypermap::wire {

void EncodePoint(const Point& p, v1::Point* message);
void EncodePolygon(const Polygon& polygon, v1::Polygon* message);
void EncodeShape(const Shape& shape, v1::Shape* message);
void EncodePose(const PlanarTransform& pose, v1::Pose* message);
void EncodeTransform(const FrameTransform& transform, v1::Transform* message);

// INVALID_ARGUMENT for coordinates that are not finite.
absl::StatusOr<Point> DecodePoint(absl::string_view field, const v1::Point& message);
absl::StatusOr<PlanarTransform> DecodePose(absl::string_view field, const v1::Pose& message);
absl::StatusOr<FrameTransform> DecodeTransform(absl::string_view field,
                                               const v1::Transform& message);

// Validates and normalises as Polygon::Make. RESOURCE_EXHAUSTED past limits.max_vertices.
absl::StatusOr<Polygon> DecodePolygon(absl::string_view field, const v1::Polygon& message,
                                      const DecodeLimits& limits);

// A polygon of an answer, with its exact vertices.
absl::StatusOr<Polygon> DecodePolygon(absl::string_view field, const v1::Polygon& message);

// Validates and normalises as the Make of its kind. RESOURCE_EXHAUSTED past limits.max_vertices.
absl::StatusOr<Shape> DecodeShape(absl::string_view field, const v1::Shape& message,
                                  const DecodeLimits& limits);

// A shape of an answer, with its exact vertices.
absl::StatusOr<Shape> DecodeShape(absl::string_view field, const v1::Shape& message);

v1::ShapeKind EncodeShapeKind(ShapeKind kind);
// INVALID_ARGUMENT for a kind that is missing or not known.
absl::StatusOr<ShapeKind> DecodeShapeKind(absl::string_view field, v1::ShapeKind kind);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_GEOMETRY_H_
