// Points, shapes, poses and transforms on the wire.
//
// In this folder, Encode... fills an empty message from a domain value. Decode... makes a domain
// value from a message, or returns an error that names the field: `field` is the position of the
// message in its request ("edits[3].put_object.object.shape"). Decode functions without limits are
// for answers, which the server has validated: they check only the form of the message. All
// functions are safe to call from any thread.
#ifndef HYPERMAP_WIRE_GEOMETRY_H_
#define HYPERMAP_WIRE_GEOMETRY_H_

#include <optional>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/limits/limits.h"
#include "google/protobuf/repeated_field.h"
#include "hypermap/v1/geometry.pb.h"
#include "map/frames/frame_tree.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/polygon.h"
#include "map/geometry/shape.h"

namespace hypermap::wire {

void EncodePoint(const Point& p, v1::Point* message);
void EncodePolygon(const Polygon& polygon, v1::Polygon* message);
void EncodeShape(const Shape& shape, v1::Shape* message);
void EncodePose(const PlanarTransform& pose, v1::Pose* message);
void EncodeTransform(const FrameTransform& transform, v1::Transform* message);

// Adds the nine numbers of a covariance of (x, y, yaw), row-major.
void EncodeCovariance(const Eigen::Matrix3d& covariance,
                      google::protobuf::RepeatedField<double>* numbers);
// nullopt if there are no numbers. INVALID_ARGUMENT if there are others than nine.
absl::StatusOr<std::optional<Eigen::Matrix3d>> DecodeCovariance(
    absl::string_view field, const google::protobuf::RepeatedField<double>& numbers);

// INVALID_ARGUMENT for coordinates that are not finite.
absl::StatusOr<Point> DecodePoint(absl::string_view field, const v1::Point& message);
absl::StatusOr<PlanarTransform> DecodePose(absl::string_view field, const v1::Pose& message);
absl::StatusOr<FrameTransform> DecodeTransform(absl::string_view field,
                                               const v1::Transform& message);

// Validates and normalises like Polygon::Make. RESOURCE_EXHAUSTED for more than
// limits.max_vertices.
absl::StatusOr<Polygon> DecodePolygon(absl::string_view field, const v1::Polygon& message,
                                      const Limits& limits);

// Decodes the area of a query, watch, replica or exploration like DecodePolygon.
// RESOURCE_EXHAUSTED for more than limits.max_question_vertices, too.
absl::StatusOr<Polygon> DecodeQuestionArea(absl::string_view field, const v1::Polygon& message,
                                           const Limits& limits);

// Decodes a polygon of an answer, with its exact vertices.
absl::StatusOr<Polygon> DecodePolygon(absl::string_view field, const v1::Polygon& message);

// Validates and normalises like the Make function of its kind. RESOURCE_EXHAUSTED for more than
// limits.max_vertices.
absl::StatusOr<Shape> DecodeShape(absl::string_view field, const v1::Shape& message,
                                  const Limits& limits);

// Decodes a shape of an answer, with its exact vertices.
absl::StatusOr<Shape> DecodeShape(absl::string_view field, const v1::Shape& message);

v1::ShapeKind EncodeShapeKind(ShapeKind kind);
// INVALID_ARGUMENT for a kind that is missing or unknown.
absl::StatusOr<ShapeKind> DecodeShapeKind(absl::string_view field, v1::ShapeKind kind);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_GEOMETRY_H_
