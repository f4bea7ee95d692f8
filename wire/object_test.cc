#include "wire/object.h"

#include <gtest/gtest.h>

#include <limits>

#include "base/limits/limits.h"
#include "tests/support/random_map.h"

namespace hypermap::wire {
namespace {

SemanticObject Desk() {
  SemanticObject object;
  object.id = int64_t{1} << 40;
  object.label = "Schreibtisch für zwei";
  object.classes = {{"table", 0.7}, {"desk", 1.0}};
  object.existence = 0.25;
  object.shape =
      *Polygon::Make({{0, 0}, {2, 0}, {2, 1}, {0, 1}}, {{{0.5, 0.2}, {1, 0.2}, {1, 0.4}}});
  object.height = HeightRange{0.0, 0.75};
  object.tags = {"furniture", "b", "a"};
  object.attributes = {{"movable", true},
                       {"serial", std::numeric_limits<int64_t>::min()},
                       {"mass_kg", 12.5},
                       {"note", std::string("heavy")}};
  return object;
}

TEST(ObjectOnTheWire, ComesBackEqual) {
  v1::Object message;
  EncodeObject(Desk(), PlanarTransform(), &message);
  const auto request = DecodeObject("object", message, Limits());
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(*request, Desk());
  const auto answer = DecodeObject("object", message);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(*answer, Desk());
}

TEST(ObjectOnTheWire, AnswersTellVersionAndEndAndRequestsDoNot) {
  SemanticObject desk = Desk();
  desk.version = 31;
  desk.expires_at = absl::FromUnixMillis(1'700'000'000'123);
  v1::Object message;
  EncodeObject(desk, PlanarTransform(), &message);
  const auto answer = DecodeObject("object", message);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->version, 31);
  EXPECT_EQ(answer->expires_at, desk.expires_at);
  const auto request = DecodeObject("object", message, Limits());
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->version, 0);
  EXPECT_EQ(request->expires_at, std::nullopt);
}

TEST(ObjectOnTheWire, RandomOnesComeBackEqualThroughBytes) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng rng(seed);
  for (int i = 0; i < 200; ++i) {
    const SemanticObject object = hypermap::testing::RandomObject(rng, {1, 2}, 3.0);
    v1::Object sent;
    EncodeObject(object, PlanarTransform(), &sent);
    v1::Object received;
    ASSERT_TRUE(received.ParseFromString(sent.SerializeAsString()));
    const auto decoded = DecodeObject("object", received, Limits());
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, object);
  }
}

TEST(ObjectOnTheWire, ShapeAndCentroidAreInTheCallersFrame) {
  const PlanarTransform map_from_dock(10.0, 20.0, 1.25);
  v1::Object message;
  EncodeObject(Desk(), map_from_dock, &message);
  const auto decoded = DecodeObject("object", message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->shape, map_from_dock * Desk().shape);
  const Point centroid = map_from_dock * Centroid(Desk().shape);
  EXPECT_NEAR(message.centroid().x(), centroid.x, 1e-9);
  EXPECT_NEAR(message.centroid().y(), centroid.y, 1e-9);
}

TEST(ObjectOnTheWire, CentroidOfALineIsThatOfItsLength) {
  SemanticObject lane;
  lane.label = "lane";
  lane.shape = *LineString::Make({{0, 0}, {4, 0}, {4, 2}});
  v1::Object message;
  EncodeObject(lane, PlanarTransform(), &message);
  EXPECT_DOUBLE_EQ(message.centroid().x(), (4 * 2 + 2 * 4) / 6.0);
  EXPECT_DOUBLE_EQ(message.centroid().y(), (4 * 0 + 2 * 1) / 6.0);
  lane.shape = *Shape::MakePoint({0.1, -7.5});
  message.Clear();
  EncodeObject(lane, PlanarTransform(), &message);
  EXPECT_EQ(message.centroid().x(), 0.1);
  EXPECT_EQ(message.centroid().y(), -7.5);
}

TEST(ObjectOnTheWire, ExistenceLeftOutIsCertain) {
  v1::Object message;
  EncodeObject(Desk(), PlanarTransform(), &message);
  message.clear_existence();
  EXPECT_EQ(DecodeObject("object", message, Limits())->existence, 1.0);
  message.set_existence(0.0);
  EXPECT_EQ(DecodeObject("object", message, Limits())->existence, 0.0);
}

TEST(ObjectOnTheWire, BadOnesNameTheField) {
  v1::Object message;
  EXPECT_EQ(DecodeObject("object", message, Limits()).status(),
            absl::InvalidArgumentError("object.shape is missing"));
  EncodeObject(Desk(), PlanarTransform(), &message);
  (*message.mutable_attributes())["color"];
  EXPECT_EQ(DecodeObject("object", message, Limits()).status(),
            absl::InvalidArgumentError("object.attributes[color] has no value"));
  message.clear_attributes();
  v1::Ring* outer = message.mutable_shape()->mutable_polygon()->mutable_outer();
  outer->mutable_xs()->Truncate(2);
  EXPECT_EQ(DecodeObject("object", message, Limits()).status(),
            absl::InvalidArgumentError("object.shape.polygon.outer has 2 xs and 4 ys"));
  outer->mutable_ys()->Truncate(2);
  EXPECT_EQ(
      DecodeObject("object", message, Limits()).status(),
      absl::InvalidArgumentError("object.shape.polygon: outer has fewer than 3 distinct vertices"));
}

}  // namespace
}  // namespace hypermap::wire
