#include "wire/geometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "base/limits/limits.h"
#include "tests/support/not_finite.h"
#include "tests/support/random_map.h"

namespace hypermap::wire {
namespace {

using ::testing::HasSubstr;

using hypermap::testing::kNan;
constexpr double kInf = std::numeric_limits<double>::infinity();

v1::Polygon PolygonMessage(const std::vector<std::vector<Point>>& rings) {
  v1::Polygon message;
  for (const auto& ring : rings) {
    v1::Ring* out = &ring == &rings.front() ? message.mutable_outer() : message.add_holes();
    for (const Point& p : ring) {
      out->add_xs(p.x);
      out->add_ys(p.y);
    }
  }
  return message;
}

TEST(PointOnTheWire, ComesBackExactly) {
  v1::Point message;
  EncodePoint({0.1, -1e300}, &message);
  EXPECT_EQ(*DecodePoint("point", message), (Point{0.1, -1e300}));
}

TEST(PointOnTheWire, MustBeFinite) {
  for (const double bad : {kNan, kInf, -kInf}) {
    v1::Point message;
    EncodePoint({0.0, bad}, &message);
    const auto decoded = DecodePoint("point", message);
    EXPECT_EQ(decoded.status(), absl::InvalidArgumentError("point is not finite"));
  }
}

TEST(PolygonOnTheWire, RandomOnesComeBackEqual) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng rng(seed);
  for (int i = 0; i < 200; ++i) {
    const Polygon polygon = hypermap::testing::RandomPolygon(rng, {3.0, -7.0}, 5.0);
    v1::Polygon message;
    EncodePolygon(polygon, &message);
    const auto validated = DecodePolygon("area", message, Limits());
    ASSERT_TRUE(validated.ok()) << validated.status();
    EXPECT_EQ(*validated, polygon);
    const auto answer = DecodePolygon("area", message);
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(*answer, polygon);
  }
}

TEST(PolygonOnTheWire, RequestIsNormalised) {
  const v1::Polygon clockwise_and_closed =
      PolygonMessage({{{0, 0}, {0, 2}, {2, 2}, {2, 0}, {0, 0}}});
  const auto polygon = DecodePolygon("area", clockwise_and_closed, Limits());
  ASSERT_TRUE(polygon.ok()) << polygon.status();
  EXPECT_EQ(polygon->num_vertices(), 4);
  EXPECT_DOUBLE_EQ(Area(*polygon), 4.0);
}

TEST(PolygonOnTheWire, BadRequestsNameThePlace) {
  const std::vector<Point> square = {{0, 0}, {9, 0}, {9, 9}, {0, 9}};
  const struct {
    const char* name;
    v1::Polygon message;
    const char* error;
  } cases[] = {
      {"nothing", v1::Polygon(), "area.outer is missing"},
      {"no points", PolygonMessage({{}}), "area: outer has fewer than 3 distinct vertices"},
      {"two points", PolygonMessage({{{0, 0}, {1, 1}}}),
       "area: outer has fewer than 3 distinct vertices"},
      {"nan", PolygonMessage({{{0, 0}, {1, 0}, {1, kNan}}}), "area.outer[2] is not finite"},
      {"infinite", PolygonMessage({{{0, 0}, {-kInf, 0}, {1, 1}}}), "area.outer[1] is not finite"},
      {"nan in a hole", PolygonMessage({square, {{1, 1}, {2, 1}, {kNan, 2}}}),
       "area.holes[0][2] is not finite"},
      {"crosses itself", PolygonMessage({{{0, 0}, {2, 2}, {2, 0}, {0, 2}}}), "crosses itself"},
      {"hole outside", PolygonMessage({square, {{20, 1}, {21, 1}, {21, 2}}}), "area: holes[0]"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    const auto polygon = DecodePolygon("area", c.message, Limits());
    EXPECT_TRUE(absl::IsInvalidArgument(polygon.status())) << polygon.status();
    EXPECT_THAT(std::string(polygon.status().message()), HasSubstr(c.error));
  }
}

TEST(PolygonOnTheWire, VerticesOfAllRingsCountAgainstTheLimit) {
  const v1::Polygon message =
      PolygonMessage({{{0, 0}, {9, 0}, {9, 9}, {0, 9}}, {{1, 1}, {2, 1}, {2, 2}}});
  Limits limits;
  limits.max_vertices = 7;
  EXPECT_TRUE(DecodePolygon("area", message, limits).ok());
  limits.max_vertices = 6;
  const auto refused = DecodePolygon("area", message, limits);
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status())) << refused.status();
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("--max_vertices"));
}

TEST(PolygonOnTheWire, A4AreasOfQuestionsHaveALimitOfTheirOwn) {
  const v1::Polygon message =
      PolygonMessage({{{0, 0}, {9, 0}, {9, 9}, {0, 9}}, {{1, 1}, {2, 1}, {2, 2}}});
  Limits limits;
  limits.max_question_vertices = 7;
  EXPECT_TRUE(DecodeQuestionArea("area", message, limits).ok());
  limits.max_question_vertices = 6;
  EXPECT_TRUE(DecodePolygon("area", message, limits).ok());
  EXPECT_EQ(DecodeQuestionArea("area", message, limits).status(),
            absl::ResourceExhaustedError("area has 7 vertices, --max_question_vertices is 6"));
  limits.max_question_vertices = 7;
  limits.max_vertices = 6;
  EXPECT_EQ(DecodeQuestionArea("area", message, limits).status(),
            absl::ResourceExhaustedError("area has 7 vertices, --max_vertices is 6"));
}

TEST(PolygonOnTheWire, AnswersOfAnotherShapeAreRefused) {
  EXPECT_FALSE(DecodePolygon("polygon", v1::Polygon()).ok());
  EXPECT_FALSE(DecodePolygon("polygon", PolygonMessage({{{0, 0}, {1, 1}}})).ok());
  EXPECT_FALSE(DecodePolygon("polygon", PolygonMessage({{{0, 0}, {1, 1}, {kNan, 0}}})).ok());
}

TEST(PolygonOnTheWire, ColumnsOfDifferentLengthsAreRefused) {
  v1::Polygon outer = PolygonMessage({{{0, 0}, {9, 0}, {9, 9}, {0, 9}}});
  outer.mutable_outer()->add_xs(4);
  const absl::Status outer_error = absl::InvalidArgumentError("area.outer has 5 xs and 4 ys");
  EXPECT_EQ(DecodePolygon("area", outer, Limits()).status(), outer_error);
  EXPECT_EQ(DecodePolygon("area", outer).status(), outer_error);
  v1::Polygon hole = PolygonMessage({{{0, 0}, {9, 0}, {9, 9}, {0, 9}}, {{1, 1}, {2, 1}, {2, 2}}});
  hole.mutable_holes(0)->add_ys(4);
  const absl::Status hole_error = absl::InvalidArgumentError("area.holes[0] has 3 xs and 4 ys");
  EXPECT_EQ(DecodePolygon("area", hole, Limits()).status(), hole_error);
  EXPECT_EQ(DecodePolygon("area", hole).status(), hole_error);
}

// Returns the message as its receiver parses it.
v1::Shape Received(const Shape& shape) {
  v1::Shape sent;
  EncodeShape(shape, &sent);
  v1::Shape received;
  EXPECT_TRUE(received.ParseFromString(sent.SerializeAsString()));
  return received;
}

v1::Shape LineMessage(const std::vector<Point>& vertices) {
  v1::Shape message;
  v1::LineString* line = message.mutable_line_string();
  for (const Point& p : vertices) {
    line->add_xs(p.x);
    line->add_ys(p.y);
  }
  return message;
}

v1::Shape PointMessage(const Point& p) {
  v1::Shape message;
  EncodePoint(p, message.mutable_point());
  return message;
}

TEST(ShapeOnTheWire, RandomOnesOfEachKindComeBackEqual) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng rng(seed);
  for (int i = 0; i < 300; ++i) {
    const Shape shape = hypermap::testing::RandomShape(rng, {3.0, -7.0}, 5.0);
    const v1::Shape message = Received(shape);
    const auto validated = DecodeShape("shape", message, Limits());
    ASSERT_TRUE(validated.ok()) << validated.status();
    EXPECT_EQ(*validated, shape);
    const auto answer = DecodeShape("shape", message);
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(*answer, shape);
  }
}

TEST(ShapeOnTheWire, RequestIsNormalisedAndAnswerIsNot) {
  const v1::Shape repeated = LineMessage({{0, 0}, {0, 0}, {1, 0}, {1, 0}, {0, 0}});
  const auto request = DecodeShape("shape", repeated, Limits());
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->line_string().vertices(), (std::vector<Point>{{0, 0}, {1, 0}, {0, 0}}));
  const auto answer = DecodeShape("shape", repeated);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->num_vertices(), 5);
}

TEST(ShapeOnTheWire, BadRequestsNameTheField) {
  v1::Shape lengths = LineMessage({{0, 0}, {1, 0}});
  lengths.mutable_line_string()->add_ys(1);
  v1::Shape polygon;
  polygon.mutable_polygon();
  const struct {
    const char* name;
    v1::Shape message;
    const char* error;
  } cases[] = {
      {"nothing", v1::Shape(), "object.shape is missing"},
      {"no ring", polygon, "object.shape.polygon.outer is missing"},
      {"empty line", LineMessage({}),
       "object.shape.line_string: line string has fewer than 2 distinct vertices"},
      {"line of one place", LineMessage({{1, 2}, {1, 2}}),
       "object.shape.line_string: line string has fewer than 2 distinct vertices"},
      {"columns of a line", lengths, "object.shape.line_string has 2 xs and 3 ys"},
      {"line with nan", LineMessage({{0, 0}, {1, kNan}}),
       "object.shape.line_string[1] is not finite"},
      {"line too far", LineMessage({{0, 0}, {1, 0}, {2e9, 0}}),
       "object.shape.line_string: vertices[2] is more than 1e+09 m from the origin"},
      {"infinite point", PointMessage({0, kInf}), "object.shape: point is not finite"},
      {"point too far", PointMessage({-2e9, 0}),
       "object.shape: point is more than 1e+09 m from the origin"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    EXPECT_EQ(DecodeShape("object.shape", c.message, Limits()).status(),
              absl::InvalidArgumentError(c.error));
  }
}

TEST(ShapeOnTheWire, BadAnswersNameTheField) {
  EXPECT_EQ(DecodeShape("shape", v1::Shape()).status(),
            absl::InvalidArgumentError("shape is missing"));
  EXPECT_EQ(DecodeShape("shape", LineMessage({{1, 2}})).status(),
            absl::InvalidArgumentError("shape.line_string has fewer than 2 vertices"));
  EXPECT_EQ(DecodeShape("shape", PointMessage({kNan, 0})).status(),
            absl::InvalidArgumentError("shape.point is not finite"));
}

TEST(ShapeOnTheWire, VerticesCountAgainstTheLimit) {
  Limits limits;
  limits.max_vertices = 3;
  EXPECT_TRUE(DecodeShape("shape", LineMessage({{0, 0}, {1, 0}, {2, 0}}), limits).ok());
  const auto line = DecodeShape("shape", LineMessage({{0, 0}, {1, 0}, {2, 0}, {3, 0}}), limits);
  EXPECT_TRUE(absl::IsResourceExhausted(line.status())) << line.status();
  EXPECT_THAT(std::string(line.status().message()),
              HasSubstr("shape.line_string has 4 vertices, --max_vertices is 3"));
  v1::Shape rings;
  *rings.mutable_polygon() = PolygonMessage({{{0, 0}, {9, 0}, {0, 9}}, {{1, 1}, {2, 1}, {2, 2}}});
  const auto polygon = DecodeShape("shape", rings, limits);
  EXPECT_TRUE(absl::IsResourceExhausted(polygon.status())) << polygon.status();
  EXPECT_THAT(std::string(polygon.status().message()),
              HasSubstr("shape.polygon has 6 vertices, --max_vertices is 3"));
}

TEST(ShapeKindOnTheWire, EveryOneComesBack) {
  for (const ShapeKind kind : kAllShapeKinds) {
    EXPECT_EQ(*DecodeShapeKind("kind", EncodeShapeKind(kind)), kind);
  }
  EXPECT_EQ(DecodeShapeKind("kind", v1::SHAPE_KIND_UNSPECIFIED).status(),
            absl::InvalidArgumentError("kind is missing"));
  EXPECT_EQ(DecodeShapeKind("kind", static_cast<v1::ShapeKind>(9)).status(),
            absl::InvalidArgumentError("kind is not a known kind: 9"));
}

TEST(PoseOnTheWire, ComesBackExactly) {
  const PlanarTransform pose(1.25, -3.5, 0.7);
  v1::Pose message;
  EncodePose(pose, &message);
  EXPECT_EQ(*DecodePose("pose", message), pose);
}

TEST(TransformOnTheWire, ComesBackExactly) {
  const FrameTransform transform{"map", "dock", PlanarTransform(1, 2, -0.5)};
  v1::Transform message;
  EncodeTransform(transform, &message);
  EXPECT_EQ(*DecodeTransform("transform", message), transform);
}

TEST(TransformOnTheWire, MustHaveAFinitePose) {
  v1::Transform message;
  EXPECT_EQ(DecodeTransform("transform", message).status(),
            absl::InvalidArgumentError("transform.parent_from_child is missing"));
  message.mutable_parent_from_child()->set_yaw(kInf);
  EXPECT_EQ(DecodeTransform("transform", message).status(),
            absl::InvalidArgumentError("transform.parent_from_child is not finite"));
}

}  // namespace
}  // namespace hypermap::wire
