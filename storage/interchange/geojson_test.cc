#include "storage/interchange/geojson.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "base/limits/limits.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "nlohmann/json.hpp"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using hypermap::testing::MakeSnapshot;
using hypermap::testing::RandomSite;
using hypermap::testing::Rng;
using hypermap::testing::TestSeed;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kChair[] = R"({"type": "Feature", "geometry": {"type": "Polygon", "coordinates":
    [[[0, 0], [0, 1], [1, 1], [1, 0], [0, 0]]]}, "properties": {"label": "chair"}})";

std::string Collection(const std::string& features, const std::string& members = "") {
  return R"({"type": "FeatureCollection", )" + members + R"("features": [)" + features + "]}";
}

std::string FeatureWith(const std::string& properties, const std::string& members = "") {
  return R"({"type": "Feature", )" + members + R"("geometry": {"type": "Polygon", "coordinates":
      [[[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]]]}, "properties": )" +
         properties + "}";
}

Snapshot Import(const std::string& data, const Snapshot* before = nullptr) {
  auto imported = DecodeGeoJson(data, "semantic", before, {});
  EXPECT_TRUE(imported.ok()) << imported.status();
  Snapshot empty;
  empty.map_name = "m";
  if (!imported.ok()) return empty;
  auto applied = Apply(before ? *before : empty, imported->batch);
  EXPECT_TRUE(applied.ok()) << applied.status();
  return applied.ok() ? *applied->snapshot : empty;
}

std::vector<ObjectPtr> Objects(const Snapshot& snapshot) {
  return dynamic_cast<const SemanticLayer&>(*snapshot.FindLayer("semantic")).Objects();
}

TEST(DecodeGeoJsonTest, MakesTheLayerInTheCollectionsFrame) {
  const Snapshot map = Import(Collection(kChair, R"("frame": "dock", )"));
  EXPECT_EQ(map.FindLayer("semantic")->spec().frame_id, "dock");
  ASSERT_EQ(Objects(map).size(), 1u);
  EXPECT_EQ(Objects(map)[0]->label, "chair");
  EXPECT_THAT(Objects(map)[0]->classes, ElementsAre(std::pair("chair", 1.0)));
  EXPECT_EQ(Objects(map)[0]->shape, Polygon::FromBox({{0, 0}, {1, 1}}));
}

TEST(DecodeGeoJsonTest, ReadsAllProperties) {
  const Snapshot map = Import(FeatureWith(R"({"name": "x", "class": "cup", "existence": 0.5,
      "classes": {"cup": 0.75, "bowl": 0.25}, "tags": ["a", "b"], "height": [0.7, 0.8],
      "n": 3, "w": 1.5, "ok": true, "nested": {"a": [1]}, "nothing": null})"));
  const SemanticObject& cup = *Objects(map).at(0);
  EXPECT_EQ(cup.label, "cup");
  EXPECT_EQ(cup.existence, 0.5);
  EXPECT_EQ(cup.classes.at("bowl"), 0.25);
  EXPECT_THAT(cup.tags, ElementsAre("a", "b"));
  EXPECT_EQ(cup.height, (HeightRange{0.7, 0.8}));
  const Attributes expected = {{"name", std::string("x")},
                               {"n", int64_t{3}},
                               {"w", 1.5},
                               {"ok", true},
                               {"nested", std::string(R"({"a":[1]})")}};
  EXPECT_EQ(cup.attributes, expected);
}

TEST(DecodeGeoJsonTest, IdsReplaceAndNullGeometriesDelete) {
  const Snapshot two = Import(Collection(std::string(kChair) + "," + kChair));
  const Snapshot after =
      Import(Collection(FeatureWith(R"({"label": "couch"})", R"("id": 1, )") +
                        R"(, {"type": "Feature", "id": 2, "geometry": null, "properties": null})"),
             &two);
  ASSERT_EQ(Objects(after).size(), 1u);
  EXPECT_EQ(Objects(after)[0]->id, 1);
  EXPECT_EQ(Objects(after)[0]->label, "couch");
}

TEST(DecodeGeoJsonTest, UnknownIdsAreNewObjectsAndReported) {
  const auto imported =
      DecodeGeoJson(FeatureWith(R"({"label": "couch"})", R"("id": 77, )"), "semantic", nullptr, {});
  ASSERT_TRUE(imported.ok());
  EXPECT_EQ(std::get<PutObject>(imported->batch.edits.at(1)).object.id, 0);
  EXPECT_THAT(imported->repairs, ElementsAre(HasSubstr("1 features have ids")));
}

TEST(DecodeGeoJsonTest, MultiPolygonsAreAnObjectAPart) {
  const Snapshot map = Import(R"({"type": "Feature", "properties": {"label": "rug"}, "geometry":
      {"type": "MultiPolygon", "coordinates": [[[[0,0],[1,0],[1,1]]], [[[5,5],[6,5],[6,6,9]]]]}})");
  EXPECT_EQ(Objects(map).size(), 2u);
}

std::string FeatureOf(const std::string& type, const std::string& coordinates,
                      const std::string& members = "") {
  return R"({"type": "Feature", )" + members +
         R"("properties": {"label": "x"}, "geometry": {"type": ")" + type +
         R"(", "coordinates": )" + coordinates + "}}";
}

TEST(DecodeGeoJsonTest, ReadsEveryKindOfShape) {
  const Snapshot map = Import(Collection(FeatureOf("Polygon", "[[[0,0],[1,0],[1,1],[0,0]]]") + "," +
                                         FeatureOf("LineString", "[[0,0],[2,0],[2,3]]") + "," +
                                         FeatureOf("Point", "[4,-5.5]")));
  const std::vector<ObjectPtr> objects = Objects(map);
  ASSERT_EQ(objects.size(), 3u);
  EXPECT_EQ(objects[0]->shape, *Polygon::Make({{0, 0}, {1, 0}, {1, 1}}));
  EXPECT_EQ(objects[1]->shape, *LineString::Make({{0, 0}, {2, 0}, {2, 3}}));
  EXPECT_EQ(objects[2]->shape, *Shape::MakePoint({4, -5.5}));
}

TEST(DecodeGeoJsonTest, MultiLineStringsAndMultiPointsAreAnObjectAPart) {
  const Snapshot before = Import(FeatureOf("Point", "[9,9]"));
  const std::string lines = FeatureOf("MultiLineString", "[[[0,0],[2,0]],[[0,1],[2,1],[2,4]]]");
  const std::string points = FeatureOf("MultiPoint", "[[1,2],[3,4],[5,6]]", R"("id": 1, )");
  const auto imported = DecodeGeoJson(Collection(lines + "," + points), "semantic", &before, {});
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_THAT(imported->repairs, ElementsAre("features[0]: MultiLineString put as 2 objects",
                                             "features[1]: MultiPoint put as 3 objects"));
  const std::vector<ObjectPtr> objects = Objects(*Apply(before, imported->batch)->snapshot);
  ASSERT_EQ(objects.size(), 5u);
  // The first point has replaced the object with its id.
  EXPECT_EQ(objects[0]->shape, *Shape::MakePoint({1, 2}));
  EXPECT_EQ(objects[1]->shape, *LineString::Make({{0, 0}, {2, 0}}));
  EXPECT_EQ(objects[2]->shape, *LineString::Make({{0, 1}, {2, 1}, {2, 4}}));
  EXPECT_EQ(objects[4]->shape, *Shape::MakePoint({5, 6}));
}

TEST(DecodeGeoJsonTest, RepeatedVerticesOfLinesAreDropped) {
  const Snapshot map = Import(FeatureOf("LineString", "[[0,0],[0,0],[2,0],[2,0],[0,0]]"));
  EXPECT_EQ(Objects(map).at(0)->shape, *LineString::Make({{0, 0}, {2, 0}, {0, 0}}));
}

TEST(DecodeGeoJsonTest, LayersTakeTheirKindsOnly) {
  LayerSpec docks{.name = "semantic"};
  docks.shape_kinds = {ShapeKind::kPoint};
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{docks}}});
  EXPECT_EQ(Objects(Import(FeatureOf("Point", "[1,2]"), &before)).size(), 1u);
  const auto imported =
      DecodeGeoJson(FeatureOf("LineString", "[[0,0],[1,2]]"), "semantic", &before, {});
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_THAT(Apply(before, imported->batch).status().ToString(), HasSubstr("line_string"));
}

TEST(DecodeGeoJsonTest, FillsTheCellsOfAGrid) {
  const LayerSpec grid{.name = "semantic",
                       .kind = LayerKind::kOccupancy,
                       .grid = GridGeometry{PlanarTransform(), 1.0}};
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{grid}}});
  for (const auto& [value, expected] : {std::pair<std::string, std::optional<double>>{"0.25", 0.25},
                                        {"\"Occupied\"", 1.0},
                                        {"\"free\"", 0.0},
                                        {"null", std::nullopt}}) {
    const Snapshot after = Import(FeatureWith("{\"value\": " + value + "}"), &before);
    const auto& layer = dynamic_cast<const GridLayer&>(*after.FindLayer("semantic"));
    EXPECT_EQ(layer.extent(), (CellBox{0, 2, 0, 2}));
    EXPECT_EQ(layer.ValueAt({1, 1}), expected);
  }
  for (const std::string properties : {"{}", R"({"value": "explored"})", R"({"value": [1]})"}) {
    EXPECT_EQ(DecodeGeoJson(FeatureWith(properties), "semantic", &before, {}).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
  EXPECT_EQ(DecodeGeoJson(FeatureOf("Point", "[1,1]"), "semantic", &before, {}).status().message(),
            "features[0]: geometry: type is \"Point\", but only polygons fill cells");
}

TEST(DecodeGeoJsonTest, BadInputIsRefusedWithItsPlace) {
  const std::string deep = std::string(10000, '[') + std::string(10000, ']');
  const struct {
    std::string data;
    std::string message;
  } cases[] = {
      {"", "not JSON"},
      {"{", "not JSON"},
      {"\xff", "not JSON"},
      {deep, "nested deeper"},
      {"[1, 2]", "type is"},
      {"{}", "type is"},
      {R"({"type": "FeatureCollection"})", "features is no list"},
      {Collection("3"), "features[0]: type is not Feature"},
      {Collection(kChair, R"("frame": "../x", )"), "frame must begin"},
      {FeatureWith("{}"), "properties: label is missing"},
      {FeatureWith("null"), "properties.label is missing"},
      {FeatureWith(R"({"label": 3})"), "label is no text"},
      {FeatureWith(R"({"label": "a", "existence": 2})"), "existence must be in [0, 1]"},
      {FeatureWith(R"({"label": "a", "classes": {"b": "c"}})"), "classes.b is no number"},
      {FeatureWith(R"({"label": "a", "tags": "b"})"), "tags is no list"},
      {FeatureWith(R"({"label": "a", "height": [2, 1]})"), "height.low_m is above"},
      {R"({"type": "Point", "coordinates": [0, 0]})", "properties.label is missing"},
      {FeatureOf("Circle", "[0, 0]"),
       "features[0]: geometry: type is \"Circle\", not one of Polygon, MultiPolygon, LineString, "
       "MultiLineString, Point, MultiPoint"},
      {R"({"type": "Circle"})",
       "type is \"Circle\", not one of FeatureCollection, Feature, Polygon"},
      {R"({"type": "Feature", "geometry": {"type": "GeometryCollection", "geometries": []}})",
       "features[0]: geometry: type is \"GeometryCollection\": an object has one shape"},
      {FeatureOf("Point", "[]"), "geometry: coordinates is no list or empty"},
      {FeatureOf("Point", "[1]"), "geometry: coordinates: not a pair of numbers"},
      {FeatureOf("Point", "[[1, 2]]"), "not a pair of numbers"},
      {FeatureOf("Point", "[1, 2e9]"), "point is more than 1e+09 m from the origin"},
      {FeatureOf("MultiPoint", "[[1, 2], 3]"), "coordinates[1]: not a pair of numbers"},
      {FeatureOf("LineString", "[[1, 2]]"), "fewer than 2 distinct vertices"},
      {FeatureOf("LineString", "[[1, 2], [1, 2]]"), "fewer than 2 distinct vertices"},
      {FeatureOf("LineString", "[1, 2]"), "coordinates: vertex 0 is no pair of numbers"},
      {FeatureOf("MultiLineString", "[[[1, 2], [3, 4]], 5]"),
       "coordinates[1]: not a list of positions"},
      {R"({"type": "Feature", "geometry": null, "properties": {}})", "geometry is missing"},
      {R"({"type": "Feature", "id": 5, "geometry": null})", "has no object 5"},
      {R"({"type": "Polygon", "coordinates": [[[0, 0], [1, 1]]]})", "distinct"},
      {R"({"type": "Polygon", "coordinates": [[[0, 0], [1, 1], ["a", 2]]]})",
       "ring 0: vertex 2 is no pair"},
      {R"({"type": "Polygon", "coordinates": [[[0, 0], [1, 1], [1, 1e999]]]})", "not JSON"},
      {R"({"type": "Polygon", "coordinates": [[[0,0],[2,2],[2,0],[0,2]]]})", "cross"},
  };
  for (const auto& c : cases) {
    const auto imported = DecodeGeoJson(c.data, "semantic", nullptr, {});
    ASSERT_FALSE(imported.ok()) << c.data.substr(0, 200);
    EXPECT_THAT(std::string(imported.status().message()), HasSubstr(c.message));
  }
}

TEST(DecodeGeoJsonTest, NoFeaturesMakeAnEmptyLayerButChangeNoOther) {
  const Snapshot made = Import(Collection(""));
  EXPECT_TRUE(Objects(made).empty());
  EXPECT_EQ(DecodeGeoJson(Collection(""), "semantic", &made, {}).status().message(),
            "features is empty");
}

TEST(DecodeGeoJsonTest, LimitsAreNamed) {
  Limits limits;
  limits.max_vertices = 4;
  EXPECT_THAT(DecodeGeoJson(kChair, "s", nullptr, limits).status().ToString(),
              HasSubstr("--max_vertices"));
  const std::string line = FeatureOf("LineString", "[[0,0],[1,0],[2,0],[3,0],[4,0]]");
  EXPECT_THAT(DecodeGeoJson(line, "s", nullptr, limits).status().ToString(),
              HasSubstr("--max_vertices"));
  limits = {};
  limits.max_import_objects = 1;
  EXPECT_THAT(DecodeGeoJson(FeatureOf("MultiPoint", "[[0,0],[1,1]]"), "s", nullptr, limits)
                  .status()
                  .ToString(),
              HasSubstr("--max_import_objects"));
  EXPECT_THAT(DecodeGeoJson(Collection(std::string(kChair) + "," + kChair), "s", nullptr, limits)
                  .status()
                  .ToString(),
              HasSubstr("--max_import_objects"));
}

TEST(EncodeGeoJsonTest, CellsAndLayersAdriftAreOmissions) {
  Rng rng(1);
  const Snapshot site = MakeSnapshot("site", RandomSite(rng, 10));
  const auto exported = EncodeGeoJson(site, {});
  ASSERT_TRUE(exported.ok());
  EXPECT_EQ(exported->files.at(0).name, "site.geojson");
  EXPECT_EQ(exported->omissions.size(), 4u);
  EXPECT_EQ(EncodeGeoJson(site, {"nope"}).status().code(), absl::StatusCode::kNotFound);
}

TEST(EncodeGeoJsonTest, TellsOfAliases) {
  const Snapshot site = MakeSnapshot(
      "site", {{CreateLayer{{.name = "s"}}, SetAliases{"s", {{"tv", {"tvmonitor"}}}}}});
  EXPECT_THAT(EncodeGeoJson(site, {})->omissions, ElementsAre("layer \"s\": 1 aliases"));
}

TEST(EncodeGeoJsonTest, TellsOfKindsOfShape) {
  LayerSpec docks{.name = "docks"};
  docks.shape_kinds = {ShapeKind::kPoint};
  EXPECT_THAT(EncodeGeoJson(MakeSnapshot("site", {{CreateLayer{docks}}}), {})->omissions,
              ElementsAre("layer \"docks\": which kinds of shape it takes"));
}

TEST(EncodeGeoJsonTest, WritesTheGeometryOfEachKind) {
  SemanticObject room{.label = "x", .shape = *Polygon::Make({{0, 0}, {1, 0}, {1, 1}})};
  SemanticObject lane{.label = "x", .shape = *LineString::Make({{0, 0}, {2.5, 0}})};
  SemanticObject dock{.label = "x", .shape = *Shape::MakePoint({4, 5})};
  const Snapshot site =
      MakeSnapshot("site", {{CreateLayer{{.name = "s"}}, PutObject{"s", room, ""},
                             PutObject{"s", lane, ""}, PutObject{"s", dock, ""}}});
  const auto exported = EncodeGeoJson(site, {});
  ASSERT_TRUE(exported.ok()) << exported.status();
  EXPECT_THAT(exported->omissions, IsEmpty());
  const auto root = nlohmann::json::parse(exported->files.at(0).data);
  const auto& features = root["features"];
  ASSERT_EQ(features.size(), 3u);
  EXPECT_EQ(features[0]["geometry"],
            nlohmann::json::parse(
                R"({"type":"Polygon","coordinates":[[[0.0,0.0],[1.0,0.0],[1.0,1.0],[0.0,0.0]]]})"));
  EXPECT_EQ(features[1]["geometry"],
            nlohmann::json::parse(R"({"type":"LineString","coordinates":[[0.0,0.0],[2.5,0.0]]})"));
  EXPECT_EQ(features[2]["geometry"],
            nlohmann::json::parse(R"({"type":"Point","coordinates":[4.0,5.0]})"));
}

TEST(EncodeGeoJsonTest, WhatIsReadBackIsWrittenTheSame) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const Snapshot site = MakeSnapshot("site", RandomSite(rng, 50));
  const auto exported = EncodeGeoJson(site, {"semantic"});
  ASSERT_TRUE(exported.ok());
  const Snapshot again = Import(exported->files[0].data);
  std::vector<ObjectPtr> expected = Objects(site);
  std::vector<ObjectPtr> actual = Objects(again);
  ASSERT_EQ(actual.size(), expected.size());
  for (size_t i = 0; i < actual.size(); ++i) {
    SemanticObject object = *actual[i];
    object.id = expected[i]->id;
    EXPECT_EQ(object, *expected[i]);
  }
}

TEST(DecodeGeoJsonTest, ReadsTheGroundTruthFiles) {
  const char* data = std::getenv("HYPERMAP_DATA");
  const std::filesystem::path folder =
      std::filesystem::path(data ? data : HYPERMAP_SOURCE_DIR "/../shared/data") / "rgbd" /
      "office_small";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  for (const char* name : {"gt.geojson", "gt_hmap.geojson"}) {
    std::ifstream file(folder / name);
    std::stringstream text;
    text << file.rdbuf();
    EXPECT_FALSE(Objects(Import(text.str())).empty());
  }
}

}  // namespace
}  // namespace hypermap::storage
