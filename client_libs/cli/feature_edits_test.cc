#include "client_libs/cli/feature_edits.h"

#include <gtest/gtest.h>

#include <string>

namespace hypermap::cli {
namespace {

constexpr char kFeatures[] = R"({"type": "FeatureCollection", "features": [
  {"type": "Feature", "id": 7, "properties": {"label": "cup"},
   "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]}},
  {"type": "Feature", "properties": {"label": "cup"},
   "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]}},
  {"type": "Feature", "id": 9, "properties": null, "geometry": null}]})";

LayerSpec Layer(LayerKind kind) {
  LayerSpec spec;
  spec.name = "things";
  spec.kind = kind;
  spec.frame_id = "dock";
  if (kind == LayerKind::kScalar) spec.grid = GridGeometry();
  return spec;
}

TEST(FeatureEditsTest, ConditionsAreOfTheEditsThatTheyCanBeOf) {
  const auto edits =
      ReadFeatureEdits(kFeatures, Layer(LayerKind::kSemantic), "site",
                       {.time_to_live = absl::Seconds(30), .if_version = 4, .if_layer_version = 6});
  ASSERT_TRUE(edits.ok()) << edits.status();
  ASSERT_EQ(edits->batch.edits.size(), 3u);
  const auto& replaced = std::get<PutObject>(edits->batch.edits[0]);
  EXPECT_EQ(replaced.object.id, 7);
  EXPECT_EQ(replaced.if_version, 4);
  EXPECT_EQ(replaced.time_to_live, absl::Seconds(30));
  EXPECT_EQ(replaced.frame_id, "site");
  const auto& added = std::get<PutObject>(edits->batch.edits[1]);
  EXPECT_EQ(added.object.id, 0);
  EXPECT_EQ(added.if_version, std::nullopt);
  EXPECT_EQ(added.time_to_live, absl::Seconds(30));
  const auto& deleted = std::get<DeleteObject>(edits->batch.edits[2]);
  EXPECT_EQ(deleted.id, 9);
  EXPECT_EQ(deleted.if_version, 4);
  ASSERT_EQ(edits->batch.if_layers.size(), 1u);
  EXPECT_EQ(edits->batch.if_layers[0].layer, "things");
  EXPECT_EQ(edits->batch.if_layers[0].version, 6);
}

TEST(FeatureEditsTest, EachKindOfGeometryIsAnObject) {
  constexpr char kShapes[] = R"({"type": "FeatureCollection", "features": [
    {"type": "Feature", "id": 7, "properties": {"label": "lane"},
     "geometry": {"type": "LineString", "coordinates": [[0, 0], [4, 0], [4, 3]]}},
    {"type": "Feature", "properties": {"label": "dock"},
     "geometry": {"type": "Point", "coordinates": [2.5, 1]}},
    {"type": "Feature", "properties": {"label": "pad"},
     "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]}}]})";
  const auto edits = ReadFeatureEdits(kShapes, Layer(LayerKind::kSemantic), "site",
                                      {.time_to_live = absl::Seconds(30), .if_version = 4});
  ASSERT_TRUE(edits.ok()) << edits.status();
  ASSERT_EQ(edits->batch.edits.size(), 3u);
  const auto& lane = std::get<PutObject>(edits->batch.edits[0]);
  EXPECT_EQ(lane.object.shape, Shape(*LineString::Make({{0, 0}, {4, 0}, {4, 3}})));
  EXPECT_EQ(lane.if_version, 4);
  const auto& dock = std::get<PutObject>(edits->batch.edits[1]);
  EXPECT_EQ(dock.object.shape, *Shape::MakePoint({2.5, 1}));
  EXPECT_EQ(dock.time_to_live, absl::Seconds(30));
  EXPECT_TRUE(std::get<PutObject>(edits->batch.edits[2]).object.shape.is_polygon());
}

TEST(FeatureEditsTest, CellsHaveNoTimeToLive) {
  const auto edits = ReadFeatureEdits(kFeatures, Layer(LayerKind::kScalar), "site",
                                      {.time_to_live = absl::Seconds(30)});
  EXPECT_TRUE(absl::IsInvalidArgument(edits.status()));
}

TEST(FeatureEditsTest, WhatIsNoGeoJsonIsRefused) {
  for (const char* text : {"", "7", "{", R"({"features": 3})", R"({"features": [3]})"}) {
    EXPECT_FALSE(ReadFeatureEdits(text, Layer(LayerKind::kSemantic), "site",
                                  {.time_to_live = absl::Seconds(30)})
                     .ok())
        << text;
  }
}

}  // namespace
}  // namespace hypermap::cli
