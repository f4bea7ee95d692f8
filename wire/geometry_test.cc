#include "wire/geometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "tests/support/random_map.h"

namespace hypermap::wire {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

v1::Polygon PolygonMessage(const std::vector<std::vector<Point>>& rings) {
  v1::Polygon message;
  for (const auto& ring : rings) {
    v1::Ring* out = &ring == &rings.front() ? message.mutable_outer() : message.add_holes();
    for (const Point& p : ring) EncodePoint(p, out->add_points());
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
    const auto validated = DecodePolygon("area", message, DecodeLimits());
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
  const auto polygon = DecodePolygon("area", clockwise_and_closed, DecodeLimits());
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
      {"nan", PolygonMessage({{{0, 0}, {1, 0}, {1, kNan}}}), "area.outer.points[2] is not finite"},
      {"infinite", PolygonMessage({{{0, 0}, {-kInf, 0}, {1, 1}}}),
       "area.outer.points[1] is not finite"},
      {"nan in a hole", PolygonMessage({square, {{1, 1}, {2, 1}, {kNan, 2}}}),
       "area.holes[0].points[2] is not finite"},
      {"crosses itself", PolygonMessage({{{0, 0}, {2, 2}, {2, 0}, {0, 2}}}), "crosses itself"},
      {"hole outside", PolygonMessage({square, {{20, 1}, {21, 1}, {21, 2}}}), "area: holes[0]"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    const auto polygon = DecodePolygon("area", c.message, DecodeLimits());
    EXPECT_TRUE(absl::IsInvalidArgument(polygon.status())) << polygon.status();
    EXPECT_THAT(std::string(polygon.status().message()), HasSubstr(c.error));
  }
}

TEST(PolygonOnTheWire, VerticesOfAllRingsCountAgainstTheLimit) {
  const v1::Polygon message =
      PolygonMessage({{{0, 0}, {9, 0}, {9, 9}, {0, 9}}, {{1, 1}, {2, 1}, {2, 2}}});
  DecodeLimits limits;
  limits.max_vertices = 7;
  EXPECT_TRUE(DecodePolygon("area", message, limits).ok());
  limits.max_vertices = 6;
  const auto refused = DecodePolygon("area", message, limits);
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status())) << refused.status();
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("--max_vertices"));
}

TEST(PolygonOnTheWire, AnswersOfAnotherShapeAreRefused) {
  EXPECT_FALSE(DecodePolygon("polygon", v1::Polygon()).ok());
  EXPECT_FALSE(DecodePolygon("polygon", PolygonMessage({{{0, 0}, {1, 1}}})).ok());
  EXPECT_FALSE(DecodePolygon("polygon", PolygonMessage({{{0, 0}, {1, 1}, {kNan, 0}}})).ok());
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
