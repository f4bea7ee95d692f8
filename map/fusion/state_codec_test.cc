#include "map/fusion/state_codec.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "tests/support/random_map.h"

namespace hypermap::fusion {
namespace {

using nlohmann::json;

// An object as version 0.1 encoded it: its shape is always a polygon.
json StoredByVersion01() {
  return {{"label", "desk"},
          {"classes", {{"desk", 0.75}, {"table", 0.5}}},
          {"existence", 0.875},
          {"polygon", {{0.0, 0.0, 4.0, 0.0, 4.0, 2.0, 0.0, 2.0}, {1.0, 0.5, 1.0, 1.0, 2.0, 1.0}}},
          {"tags", {"old"}},
          {"height", {0.25, 0.75}},
          {"attributes", {{"movable", true}, {"seen", 12}, {"mass_kg", 3.5}, {"note", "heavy"}}},
          {"expires_at_ns", 1'700'000'000'123'456'789}};
}

SemanticObject Desk() {
  SemanticObject desk;
  desk.label = "desk";
  desk.classes = {{"desk", 0.75}, {"table", 0.5}};
  desk.existence = 0.875;
  desk.shape =
      Polygon::MakeUnchecked({{{0, 0}, {4, 0}, {4, 2}, {0, 2}}, {{1, 0.5}, {1, 1}, {2, 1}}});
  desk.tags = {"old"};
  desk.height = HeightRange{0.25, 0.75};
  desk.attributes = {
      {"movable", true}, {"seen", int64_t{12}}, {"mass_kg", 3.5}, {"note", std::string("heavy")}};
  desk.expires_at = absl::FromUnixNanos(1'700'000'000'123'456'789);
  return desk;
}

TEST(StateCodecTest, ObjectOfVersion01IsRead) {
  EXPECT_EQ(DecodeObject(StoredByVersion01()), Desk());
}

TEST(StateCodecTest, ObjectWithAPolygonIsWrittenAsByVersion01) {
  EXPECT_EQ(EncodeObject(Desk()), StoredByVersion01());
}

TEST(StateCodecTest, ObjectsOfEveryShapeComeBackEqualThroughBytes) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng rng(seed);
  for (int i = 0; i < 200; ++i) {
    const SemanticObject object = hypermap::testing::RandomObject(rng, {1, 2}, 3.0);
    const std::string bytes = EncodeState("test", 1, EncodeObject(object));
    SemanticObject decoded;
    const absl::Status status = DecodeState(
        "test", 1, bytes, [&](const json& content) { decoded = DecodeObject(content); });
    ASSERT_TRUE(status.ok()) << status;
    EXPECT_EQ(decoded, object);
  }
}

TEST(StateCodecTest, ObjectWithoutAShapeIsDamage) {
  json shapeless = StoredByVersion01();
  shapeless.erase("polygon");
  const std::string bytes = EncodeState("test", 1, shapeless);
  const absl::Status status =
      DecodeState("test", 1, bytes, [](const json& content) { DecodeObject(content); });
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
}

TEST(StateCodecTest, ShapesWithoutValidVerticesAreDamage) {
  const double kInfinity = std::numeric_limits<double>::infinity();
  const struct {
    const char* field;
    json vertices;
  } cases[] = {
      {"polygon", json::array()},          {"polygon", json::array({json::array()})},
      {"polygon", {{0.0, 0.0, 1.0, 0.0}}}, {"polygon", {{0.0, 0.0, 1.0, 0.0, 1.0, kInfinity}}},
      {"line_string", {0.0, 0.0}},         {"point", json::array()},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.vertices.dump());
    json encoded = StoredByVersion01();
    encoded.erase("polygon");
    encoded[c.field] = c.vertices;
    const absl::Status status = DecodeState("test", 1, EncodeState("test", 1, encoded),
                                            [](const json& content) { DecodeObject(content); });
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  }
}

TEST(StateCodecTest, DeepNestingIsDamage) {
  const std::string bytes = std::string(1'000'000, '\x81') + '\0';  // arrays of one array each
  const absl::Status status = DecodeState("test", 1, bytes, [](const json&) {});
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace hypermap::fusion
