#include "storage/encoding/object_columns.h"

#include <functional>

#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomObject;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;

// The columns of a row with this object, which borrow `encoded`.
ObjectColumns RowOf(const SemanticObject& object, const EncodedObject& encoded) {
  return {object.id,          encoded.shape,         object.label,       object.existence,
          encoded.classes,    encoded.tags,          encoded.attributes, encoded.height_min,
          encoded.height_max, encoded.expires_at_ns, object.version};
}

TEST(ObjectColumnsTest, RandomObjectsComeBack) {
  Rng rng(TestSeed());
  for (int i = 0; i < 200; ++i) {
    SemanticObject object = RandomObject(rng, {0, 0}, 5.0);
    object.id = i + 1;
    object.version = i;
    if (i % 2 == 0) object.height = {-0.5, 2.25};
    if (i % 3 == 0) object.expires_at = absl::FromUnixNanos(1'700'000'000'123'456'789);
    const absl::StatusOr<EncodedObject> encoded = EncodeObject(object);
    ASSERT_TRUE(encoded.ok()) << encoded.status();
    const absl::StatusOr<ObjectPtr> decoded = DecodeObject(RowOf(object, *encoded));
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(**decoded, object);
    EXPECT_EQ((*decoded)->version, object.version);
  }
}

TEST(ObjectColumnsTest, OtherColumnsAreRefused) {
  SemanticObject object;
  object.id = 1;
  object.label = "dock";
  object.shape = Shape::MakePointUnchecked({1, 2});
  const EncodedObject encoded = *EncodeObject(object);
  ASSERT_TRUE(DecodeObject(RowOf(object, encoded)).ok());

  const std::function<void(ObjectColumns*)> damages[] = {
      [](ObjectColumns* columns) { columns->id = 0; },
      [](ObjectColumns* columns) { columns->version = -1; },
      [](ObjectColumns* columns) { columns->shape = "GP"; },
      [](ObjectColumns* columns) { columns->classes = "[]"; },
      [](ObjectColumns* columns) { columns->tags = "{}"; },
      [](ObjectColumns* columns) { columns->attributes = "[]"; },
      [](ObjectColumns* columns) { columns->height_max = 1.0; },
      [](ObjectColumns* columns) { columns->existence = 1.5; },
      [](ObjectColumns* columns) { columns->label = ""; },
  };
  for (size_t i = 0; i < std::size(damages); ++i) {
    ObjectColumns columns = RowOf(object, encoded);
    damages[i](&columns);
    EXPECT_FALSE(DecodeObject(columns).ok()) << i;
  }
}

}  // namespace
}  // namespace hypermap::storage
