#include "wire/geometry.h"

#include <array>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "wire/field.h"

namespace hypermap::wire {
namespace {

constexpr std::array<std::pair<ShapeKind, v1::ShapeKind>, 3> kShapeKinds{{
    {ShapeKind::kPolygon, v1::SHAPE_KIND_POLYGON},
    {ShapeKind::kLineString, v1::SHAPE_KIND_LINE_STRING},
    {ShapeKind::kPoint, v1::SHAPE_KIND_POINT},
}};

// Fills the columns of a v1::Ring or v1::LineString.
template <typename Columns>
void EncodeVertices(const std::vector<Point>& vertices, Columns* message) {
  const int size = static_cast<int>(vertices.size());
  message->mutable_xs()->Reserve(size);
  message->mutable_ys()->Reserve(size);
  double* x = message->mutable_xs()->AddNAlreadyReserved(size);
  double* y = message->mutable_ys()->AddNAlreadyReserved(size);
  for (const Point& p : vertices) {
    *x++ = p.x;
    *y++ = p.y;
  }
}

template <typename Columns>
absl::StatusOr<std::vector<Point>> DecodeVertices(const std::string& field,
                                                  const Columns& message) {
  if (message.xs_size() != message.ys_size()) {
    return InvalidField(
        field, absl::StrCat("has ", message.xs_size(), " xs and ", message.ys_size(), " ys"));
  }
  std::vector<Point> vertices(message.xs_size());
  for (int i = 0; i < message.xs_size(); ++i) {
    vertices[i] = {message.xs(i), message.ys(i)};
    if (!IsFinite(vertices[i])) {
      return InvalidField(absl::StrCat(field, "[", i, "]"), "is not finite");
    }
  }
  return vertices;
}

// Returns the outer ring, then the holes.
absl::StatusOr<Rings> DecodeRings(absl::string_view field, const v1::Polygon& message) {
  if (!message.has_outer()) return InvalidField(absl::StrCat(field, ".outer"), "is missing");
  Rings rings;
  rings.reserve(1 + message.holes_size());
  HYPERMAP_ASSIGN_OR_RETURN(Ring outer,
                            DecodeVertices(absl::StrCat(field, ".outer"), message.outer()));
  rings.push_back(std::move(outer));
  for (const v1::Ring& hole : message.holes()) {
    HYPERMAP_ASSIGN_OR_RETURN(
        Ring ring, DecodeVertices(absl::StrCat(field, ".holes[", rings.size() - 1, "]"), hole));
    rings.push_back(std::move(ring));
  }
  return rings;
}

absl::Status CheckNumVertices(absl::string_view field, int64_t vertices, const Limits& limits) {
  if (vertices <= limits.max_vertices) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat(field, " has ", vertices, " vertices, --max_vertices is ", limits.max_vertices));
}

int64_t NumVertices(const v1::Polygon& message) {
  int64_t vertices = message.outer().xs_size();
  for (const v1::Ring& hole : message.holes()) vertices += hole.xs_size();
  return vertices;
}

}  // namespace

void EncodePoint(const Point& p, v1::Point* message) {
  message->set_x(p.x);
  message->set_y(p.y);
}

void EncodePolygon(const Polygon& polygon, v1::Polygon* message) {
  const Rings& rings = polygon.rings();
  for (size_t i = 0; i < rings.size(); ++i) {
    EncodeVertices(rings[i], i == 0 ? message->mutable_outer() : message->add_holes());
  }
}

void EncodeShape(const Shape& shape, v1::Shape* message) {
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      return EncodePolygon(shape.polygon(), message->mutable_polygon());
    case ShapeKind::kLineString:
      return EncodeVertices(shape.line_string().vertices(), message->mutable_line_string());
    case ShapeKind::kPoint:
      return EncodePoint(shape.point(), message->mutable_point());
  }
}

void EncodeCovariance(const Eigen::Matrix3d& covariance,
                      google::protobuf::RepeatedField<double>* numbers) {
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) numbers->Add(covariance(row, col));
  }
}

absl::StatusOr<std::optional<Eigen::Matrix3d>> DecodeCovariance(
    absl::string_view field, const google::protobuf::RepeatedField<double>& numbers) {
  if (numbers.empty()) return std::nullopt;
  if (numbers.size() != 9) return InvalidField(field, "must have 9 numbers or none");
  return Eigen::Matrix3d(
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers.data()));
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
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform pose,
                            DecodePose(pose_field, message.parent_from_child()));
  return FrameTransform{message.parent_frame_id(), message.child_frame_id(), pose};
}

absl::StatusOr<Polygon> DecodePolygon(absl::string_view field, const v1::Polygon& message,
                                      const Limits& limits) {
  HYPERMAP_RETURN_IF_ERROR(CheckNumVertices(field, NumVertices(message), limits));
  HYPERMAP_ASSIGN_OR_RETURN(Rings rings, DecodeRings(field, message));
  std::vector<Ring> holes(std::make_move_iterator(rings.begin() + 1),
                          std::make_move_iterator(rings.end()));
  absl::StatusOr<Polygon> polygon = Polygon::Make(std::move(rings.front()), std::move(holes));
  if (!polygon.ok()) return InField(field, polygon.status());
  return polygon;
}

absl::StatusOr<Polygon> DecodeQuestionArea(absl::string_view field, const v1::Polygon& message,
                                           const Limits& limits) {
  if (const int64_t vertices = NumVertices(message); vertices > limits.max_question_vertices) {
    return absl::ResourceExhaustedError(absl::StrCat(field, " has ", vertices,
                                                     " vertices, --max_question_vertices is ",
                                                     limits.max_question_vertices));
  }
  return DecodePolygon(field, message, limits);
}

absl::StatusOr<Polygon> DecodePolygon(absl::string_view field, const v1::Polygon& message) {
  HYPERMAP_ASSIGN_OR_RETURN(Rings rings, DecodeRings(field, message));
  for (const Ring& ring : rings) {
    if (ring.size() < 3) return InvalidField(field, "has a ring of fewer than 3 vertices");
  }
  return Polygon::MakeUnchecked(std::move(rings));
}

absl::StatusOr<Shape> DecodeShape(absl::string_view field, const v1::Shape& message,
                                  const Limits& limits) {
  switch (message.shape_case()) {
    case v1::Shape::kPolygon:
      return DecodePolygon(absl::StrCat(field, ".polygon"), message.polygon(), limits);
    case v1::Shape::kLineString: {
      const std::string line_field = absl::StrCat(field, ".line_string");
      HYPERMAP_RETURN_IF_ERROR(
          CheckNumVertices(line_field, message.line_string().xs_size(), limits));
      HYPERMAP_ASSIGN_OR_RETURN(std::vector<Point> vertices,
                                DecodeVertices(line_field, message.line_string()));
      absl::StatusOr<LineString> line = LineString::Make(std::move(vertices));
      if (!line.ok()) return InField(line_field, line.status());
      return *std::move(line);
    }
    case v1::Shape::kPoint: {
      absl::StatusOr<Shape> point = Shape::MakePoint({message.point().x(), message.point().y()});
      if (!point.ok()) return InField(field, point.status());
      return point;
    }
    case v1::Shape::SHAPE_NOT_SET:
      break;
  }
  return InvalidField(field, "is missing");
}

absl::StatusOr<Shape> DecodeShape(absl::string_view field, const v1::Shape& message) {
  switch (message.shape_case()) {
    case v1::Shape::kPolygon:
      return DecodePolygon(absl::StrCat(field, ".polygon"), message.polygon());
    case v1::Shape::kLineString: {
      const std::string line_field = absl::StrCat(field, ".line_string");
      HYPERMAP_ASSIGN_OR_RETURN(std::vector<Point> vertices,
                                DecodeVertices(line_field, message.line_string()));
      if (vertices.size() < 2) return InvalidField(line_field, "has fewer than 2 vertices");
      return LineString::MakeUnchecked(std::move(vertices));
    }
    case v1::Shape::kPoint: {
      HYPERMAP_ASSIGN_OR_RETURN(const Point point,
                                DecodePoint(absl::StrCat(field, ".point"), message.point()));
      return Shape::MakePointUnchecked(point);
    }
    case v1::Shape::SHAPE_NOT_SET:
      break;
  }
  return InvalidField(field, "is missing");
}

v1::ShapeKind EncodeShapeKind(ShapeKind kind) {
  for (const auto& [domain, message] : kShapeKinds) {
    if (domain == kind) return message;
  }
  return v1::SHAPE_KIND_UNSPECIFIED;
}

absl::StatusOr<ShapeKind> DecodeShapeKind(absl::string_view field, v1::ShapeKind kind) {
  for (const auto& [domain, message] : kShapeKinds) {
    if (message == kind) return domain;
  }
  if (kind == v1::SHAPE_KIND_UNSPECIFIED) return InvalidField(field, "is missing");
  return InvalidField(field, absl::StrCat("is not a known kind: ", static_cast<int>(kind)));
}

}  // namespace hypermap::wire
