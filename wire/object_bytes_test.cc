#include "wire/object_bytes.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "google/protobuf/util/message_differencer.h"
#include "hypermap/v1/object.pb.h"
#include "hypermap/v1/query_service.pb.h"
#include "tests/support/random_map.h"
#include "wire/object.h"

namespace hypermap::wire {
namespace {

using google::protobuf::util::MessageDifferencer;

v1::Object Message(const SemanticObject& object, const PlanarTransform& caller_from_object) {
  v1::Object message;
  EncodeObject(object, caller_from_object, &message);
  return message;
}

// Expects that the bytes parse as what EncodeObject makes.
void ExpectSame(const SemanticObject& object, const PlanarTransform& caller_from_object) {
  v1::Object parsed;
  ASSERT_TRUE(parsed.ParseFromString(ObjectBytes(object, caller_from_object)));
  const v1::Object expected = Message(object, caller_from_object);
  EXPECT_TRUE(MessageDifferencer::Equals(parsed, expected)) << parsed.DebugString() << "\nis not\n"
                                                            << expected.DebugString();
}

SemanticObject ObjectOf(Shape shape) {
  SemanticObject object;
  object.id = 7;
  object.label = "thing";
  object.shape = std::move(shape);
  object.version = 3;
  return object;
}

TEST(ObjectBytes, EqualTheMessageForEachKindOfShape) {
  std::vector<Point> many;
  many.reserve(5000);
  for (int i = 0; i < 5000; ++i) many.push_back({0.5 * i, 1.0 * (i % 2)});
  for (const Shape& shape : {
           Shape(*Polygon::Make({{0, 0}, {4, 0}, {4, 4}, {0, 4}},
                                {{{1, 1}, {1, 2}, {2, 2}}, {{3, 3}, {3, 3.5}, {3.5, 3.5}}})),
           Shape(*LineString::Make({{0, 0}, {-1, 2}, {3, 3}})),
           Shape(*LineString::Make(many)),
           Shape::MakePointUnchecked({0, 0}),
           Shape::MakePointUnchecked({-1e9, 1e-9}),
       }) {
    ExpectSame(ObjectOf(shape), PlanarTransform());
    ExpectSame(ObjectOf(shape), PlanarTransform(1, -2, 0.5));
  }
}

TEST(ObjectBytes, EqualTheMessageForExtremeNumbersAndRareFields) {
  SemanticObject object = ObjectOf(Shape::MakePointUnchecked({1, 2}));
  for (const ObjectId id : {ObjectId{0}, ObjectId{127}, ObjectId{128}, ObjectId{1} << 62}) {
    object.id = id;
    ExpectSame(object, PlanarTransform());
  }
  object.existence = 0.0;
  object.label = std::string(300, 'x');
  ExpectSame(object, PlanarTransform());
  object.tags = {"b", "a"};
  ExpectSame(object, PlanarTransform());
  object.expires_at = absl::FromUnixMillis(1'700'000'000'123);
  object.height = HeightRange{0.0, 0.75};
  object.classes = {{"desk", 1.0}};
  object.attributes = {{"movable", true}};
  ExpectSame(object, PlanarTransform());
}

TEST(ObjectBytes, EqualTheMessageForRandomObjects) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng rng(seed);
  for (int i = 0; i < 200; ++i) {
    const SemanticObject object = hypermap::testing::RandomObject(rng, {1, 2}, 3.0);
    ExpectSame(object, PlanarTransform());
    ExpectSame(object, PlanarTransform(i, -i, 0.01 * i));
  }
}

TEST(ObjectBytes, AreAboutAsManyAsTheEstimate) {
  hypermap::testing::Rng rng(5);
  for (int i = 0; i < 200; ++i) {
    SemanticObject object = hypermap::testing::RandomObject(rng, {1, 2}, 3.0);
    if (i % 2 == 1) {
      object.attributes = {{"text", std::string(static_cast<size_t>(i) * 50, 'x')}, {"size", 2.5}};
      object.tags = {std::string(300, 'y'), ""};
    }
    const auto bytes = static_cast<int64_t>(ObjectBytes(object, PlanarTransform()).size());
    EXPECT_GE(EstimateObjectBytes(object), bytes);
    EXPECT_LE(EstimateObjectBytes(object), 2 * bytes + 64);
  }
}

TEST(ObjectBytes, BecomeFieldsOfTheMessageThatTheyAreAddedTo) {
  v1::LayerPart part;
  part.set_layer("things");
  for (int i = 1; i <= 3; ++i) {
    SemanticObject object = ObjectOf(Shape::MakePointUnchecked({1.0 * i, 0}));
    object.id = i;
    EXPECT_EQ(AddObjectBytes(object, PlanarTransform(), v1::LayerPart::kObjectsFieldNumber,
                             part.GetReflection()->MutableUnknownFields(&part)),
              ObjectBytes(object, PlanarTransform()).size());
  }
  v1::LayerPart received;
  ASSERT_TRUE(received.ParseFromString(part.SerializeAsString()));
  EXPECT_EQ(received.layer(), "things");
  ASSERT_EQ(received.objects_size(), 3);
  for (int i = 1; i <= 3; ++i) EXPECT_EQ(received.objects(i - 1).id(), i);
}

}  // namespace
}  // namespace hypermap::wire
