#include "wire/object_bytes.h"

#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "hypermap/v1/object.pb.h"
#include "hypermap/v1/query_service.pb.h"
#include "tests/support/random_map.h"
#include "wire/object.h"

namespace hypermap::wire {
namespace {

using google::protobuf::util::MessageDifferencer;
using hypermap::testing::Rng;
using hypermap::testing::Uniform;
using hypermap::testing::UniformInt;

// The bytes against the message that protobuf makes and reads itself.
void ExpectTheMessage(const SemanticObject& object,
                      const PlanarTransform& caller_from_object = {}) {
  v1::Object expected;
  EncodeObject(object, caller_from_object, &expected);
  std::string bytes;
  AppendObject(object, caller_from_object, &bytes);
  EXPECT_EQ(bytes.size(), expected.ByteSizeLong());
  v1::Object received;
  ASSERT_TRUE(received.ParseFromString(bytes));
  EXPECT_TRUE(MessageDifferencer::Equals(received, expected))
      << received.DebugString() << "instead of " << expected.DebugString();
  EXPECT_TRUE(received.GetReflection()->GetUnknownFields(received).empty());
}

Ring Circle(const Point& centre, double radius_m, int num_vertices) {
  Ring ring;
  for (int i = 0; i < num_vertices; ++i) {
    const double angle = 2 * std::numbers::pi * i / num_vertices;
    ring.push_back({centre.x + radius_m * std::cos(angle), centre.y + radius_m * std::sin(angle)});
  }
  return ring;
}

TEST(ObjectBytes, OfRandomObjectsAreTheirMessages) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  for (int i = 0; i < 300; ++i) {
    SemanticObject object = hypermap::testing::RandomObject(rng, {1, 2}, 3.0);
    object.id = UniformInt(rng, 0, 1000);
    object.version = UniformInt(rng, 0, 1000);
    if (i % 3 == 0) object.expires_at = absl::FromUnixMillis(UniformInt(rng, 1, 1 << 30));
    ExpectTheMessage(object);
    ExpectTheMessage(object, hypermap::testing::RandomTransform(rng, 100));
  }
}

TEST(ObjectBytes, OfWhatIsLeftOutOfMessages) {
  SemanticObject object;
  object.existence = 0.0;
  // Zeros are left out, but for the negative one.
  object.polygon = Polygon::MakeUnchecked({{{0, 0}, {3, -0.0}, {0, 4}}});
  ExpectTheMessage(object);
  object.polygon = Polygon::MakeUnchecked({{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}});
  ASSERT_EQ(Centroid(object.polygon), (Point{0, 0}));
  ExpectTheMessage(object);
}

TEST(ObjectBytes, OfLongAndLargeObjects) {
  SemanticObject object;
  object.id = std::numeric_limits<int64_t>::max();
  object.version = int64_t{1} << 35;
  for (const int num_vertices : {3, 6, 7, 127, 128, 1000, 20'000}) {
    object.label.assign(num_vertices, 'x');
    object.polygon = Polygon::MakeUnchecked(
        {Circle({5, 5}, 4, num_vertices), Circle({3, 5}, 1, num_vertices), Circle({7, 5}, 1, 5)});
    ExpectTheMessage(object);
  }
}

TEST(ObjectBytes, StandInTheFieldTheyWereAddedTo) {
  Rng rng(1);
  v1::LayerPart expected, sent, received;
  sent.set_layer("things");
  expected.set_layer("things");
  for (int i = 0; i < 3; ++i) {
    const SemanticObject object = hypermap::testing::RandomObject(rng, {1, 2}, 3.0);
    EncodeObject(object, PlanarTransform(), expected.add_objects());
    AppendObject(object, PlanarTransform(), AddField(v1::LayerPart::kObjectsFieldNumber, &sent));
  }
  ASSERT_TRUE(received.ParseFromString(sent.SerializeAsString()));
  EXPECT_TRUE(MessageDifferencer::Equals(received, expected));
}

TEST(ObjectBytes, OfMatchesAreTheirMessages) {
  Rng rng(1);
  for (const double distance_m : {0.0, 2.5}) {
    const SemanticObject object = hypermap::testing::RandomObject(rng, {1, 2}, 300.0);
    v1::NearestMatch expected, received;
    expected.set_layer("things");
    expected.set_kind(v1::LAYER_KIND_SEMANTIC);
    expected.set_distance_m(distance_m);
    EncodeObject(object, PlanarTransform(1, 2, 3), expected.mutable_object());
    std::string bytes;
    AppendMatch("things", distance_m, object, PlanarTransform(1, 2, 3), &bytes);
    ASSERT_TRUE(received.ParseFromString(bytes));
    EXPECT_TRUE(MessageDifferencer::Equals(received, expected));
  }
}

}  // namespace
}  // namespace hypermap::wire
