// The codings of single columns: JSON, object id lists, table names.
#include <limits>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/geopackage/object_id_list.h"
#include "storage/geopackage/object_json.h"
#include "storage/geopackage/table_names.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

TEST(ObjectJsonTest, IsPlainJson) {
  EXPECT_EQ(*EncodeClasses({{"a", 1}, {"b", 0.1}}), R"({"a":1.0,"b":0.1})");
  EXPECT_EQ(*EncodeTags({"x", "\"y\""}), R"(["x","\"y\""])");
  EXPECT_EQ(
      *EncodeAttributes({{"b", true}, {"d", 2.0}, {"i", int64_t{2}}, {"s", std::string("é")}}),
      R"({"b":true,"d":2.0,"i":2,"s":"é"})");
  EXPECT_EQ(*EncodeAttributes({}), "{}");
}

TEST(ObjectJsonTest, NumbersKeepTheirTypeAndValue) {
  using Double = std::numeric_limits<double>;
  using Int = std::numeric_limits<int64_t>;
  const Attributes attributes = {
      {"a", 0.1},       {"b", Double::max()}, {"c", -0.0},       {"d", Double::denorm_min()},
      {"e", 1e300},     {"f", 3.0},           {"g", Int::max()}, {"h", Int::min()},
      {"i", int64_t{0}}};
  EXPECT_EQ(*DecodeAttributes(*EncodeAttributes(attributes)), attributes);
}

TEST(ObjectJsonTest, WhatJsonCannotSayIsRefused) {
  EXPECT_EQ(EncodeAttributes({{"a", std::numeric_limits<double>::infinity()}}).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(EncodeClasses({{"a", std::nan("")}}).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(EncodeTags({"\xff"}).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ObjectJsonTest, OtherJsonIsDamage) {
  for (const char* json : {"", "{", "[]", "null", "7", R"({"a":null})", R"({"a":[]})",
                           R"({"a":1e999})", R"({"a":18446744073709551615})", "{\"a\":1}x"}) {
    EXPECT_EQ(DecodeAttributes(json).status().code(), absl::StatusCode::kDataLoss) << json;
  }
  for (const char* json : {"", "{}", "[1]", "[null]", "[[]]", "[\"\xff\"]"}) {
    EXPECT_EQ(DecodeTags(json).status().code(), absl::StatusCode::kDataLoss) << json;
  }
  for (const char* json : {"", "[]", R"({"a":"1"})", R"({"a":true})"}) {
    EXPECT_EQ(DecodeClasses(json).status().code(), absl::StatusCode::kDataLoss) << json;
  }
  const std::string deep(100'000, '[');
  EXPECT_EQ(DecodeTags(deep).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(DecodeTags(deep + std::string(100'000, ']')).status().code(),
            absl::StatusCode::kDataLoss);
}

TEST(ObjectIdListTest, ListsComeBack) {
  using Int = std::numeric_limits<int64_t>;
  for (const std::vector<ObjectId>& ids : {std::vector<ObjectId>{},
                                           {0},
                                           {0, 0, 1, 2, 3, 0},
                                           {Int::max(), 0, Int::max(), 1},
                                           {Int::min(), Int::max(), -1, 1}}) {
    EXPECT_EQ(*DecodeObjectIds(EncodeObjectIds(ids)), ids);
  }
}

TEST(ObjectIdListTest, NewObjectsTakeAByteEach) {
  std::vector<ObjectId> ids(1000);
  for (int i = 0; i < 1000; ++i) ids[i] = 1'000'000 + i;
  EXPECT_LT(EncodeObjectIds(ids).size(), 1010u);
}

TEST(ObjectIdListTest, OtherBytesAreDamage) {
  EXPECT_EQ(DecodeObjectIds("\x80").status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(DecodeObjectIds(std::string(11, '\x80')).status().code(), absl::StatusCode::kDataLoss);
}

TEST(TableNamesTest, AreTheLayersNamesWhereTheyCanBe) {
  const testing::TemporaryFolder folder;
  const auto database = Connect(folder / "x");
  const struct {
    const char* layer;
    const char* table;
  } cases[] = {{"semantic", "semantic"},       {"Robot-1.seen", "Robot_1_seen"},
               {"7th", "layer_7th"},           {"gpkg_contents", "layer_gpkg_contents"},
               {"GPKG_x", "layer_GPKG_x"},     {"rtree_a_geom", "layer_rtree_a_geom"},
               {"sqlite_x", "layer_sqlite_x"}, {"hypermap_layers", "layer_hypermap_layers"},
               {"Select", "layer_Select"},     {"layer_styles", "layer_layer_styles"}};
  for (const auto& c : cases) {
    EXPECT_EQ(TableNames::Read(database.get())->Take(c.layer), c.table);
    EXPECT_TRUE(IsLayerTableName(c.table));
  }
}

TEST(TableNamesTest, AreNotTakenTwice) {
  const testing::TemporaryFolder folder;
  const auto database = Connect(folder / "x");
  ASSERT_TRUE(database->Execute("CREATE TABLE A_b (x); CREATE TABLE a_B_2 (x)").ok());
  absl::StatusOr<TableNames> names = TableNames::Read(database.get());
  ASSERT_TRUE(names.ok()) << names.status();
  EXPECT_EQ(names->Take("a-b"), "a_b_3");
  EXPECT_EQ(names->Take("A.B"), "A_B_4");
  names->GiveBack("A_b");
  EXPECT_EQ(names->Take("a-b"), "a_b");
}

TEST(TableNamesTest, OthersAreNotForLayers) {
  for (const char* name : {"", "a b", "a\"b", "1", "table", "Gpkg_x", "hypermap_layers", "ä"}) {
    EXPECT_FALSE(IsLayerTableName(name)) << name;
  }
}

}  // namespace
}  // namespace hypermap::storage
