#include "storage/encoding/object_json.h"

#include <cmath>
#include <limits>

#include "gtest/gtest.h"

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

}  // namespace
}  // namespace hypermap::storage
