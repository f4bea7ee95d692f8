#include "wire/layer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <vector>

#include "map/layers/layer_registry.h"
#include "tests/support/random_map.h"

namespace hypermap::wire {
namespace {

using ::testing::Contains;

LayerSpec SpecOf(LayerKind kind) {
  LayerSpec spec;
  spec.name = "a-layer";
  spec.kind = kind;
  spec.frame_id = "floor/1";
  if (IsGridKind(kind)) spec.grid = GridGeometry{PlanarTransform(-3.0, 2.5, 0.3), 0.05};
  if (kind == LayerKind::kOccupancy) spec.thresholds = {0.1, 0.9};
  if (kind == LayerKind::kExploration) spec.explored_rule = CellRule::kTouched;
  if (kind == LayerKind::kScalar) spec.unit = "dBm";
  if (kind == LayerKind::kSemantic) {
    spec.aliases = {{"furniture", {"chair", "couch"}}, {"tv", {"tvmonitor"}}};
  }
  return spec;
}

TEST(LayerOnTheWire, SpecsOfEveryKindComeBackEqual) {
  for (const LayerKind kind :
       {LayerKind::kOccupancy, LayerKind::kExploration, LayerKind::kSemantic, LayerKind::kScalar}) {
    SCOPED_TRACE(LayerKindName(kind).data());
    v1::Layer message;
    EncodeLayerSpec(SpecOf(kind), &message);
    const auto decoded = DecodeLayerSpec("layer", message);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, SpecOf(kind));
  }
}

TEST(LayerOnTheWire, ShapeKindsComeBackEqual) {
  for (const ShapeKinds& kinds : {ShapeKinds(), ShapeKinds{ShapeKind::kPoint},
                                  ShapeKinds{ShapeKind::kLineString, ShapeKind::kPolygon}}) {
    LayerSpec spec = SpecOf(LayerKind::kSemantic);
    spec.shape_kinds = kinds;
    v1::Layer message;
    EncodeLayerSpec(spec, &message);
    const auto decoded = DecodeLayerSpec("layer", message);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(decoded->shape_kinds, kinds);
  }
}

TEST(LayerOnTheWire, LayerOfAllShapesListsNone) {
  v1::Layer message;
  EncodeLayerSpec(SpecOf(LayerKind::kSemantic), &message);
  EXPECT_TRUE(message.shape_kinds().empty());
}

TEST(LayerOnTheWire, PropertiesOfEveryKindComeBackEqual) {
  for (const LayerKind kind :
       {LayerKind::kOccupancy, LayerKind::kExploration, LayerKind::kSemantic, LayerKind::kScalar}) {
    SCOPED_TRACE(LayerKindName(kind).data());
    const LayerProperties properties = PropertiesOf(SpecOf(kind));
    v1::Layer message;
    EncodeLayer(*MakeEmptyLayer(SpecOf(kind)), &message);
    EXPECT_EQ(DecodeLayerProperties(message.properties()), properties);
  }
}

TEST(LayerOnTheWire, PropertiesSayWhatTheLayerHolds) {
  v1::Layer semantic;
  EncodeLayer(*MakeEmptyLayer(SpecOf(LayerKind::kSemantic)), &semantic);
  EXPECT_TRUE(semantic.properties().has_shapes());
  EXPECT_FALSE(semantic.properties().has_cells());
  v1::Layer scalar;
  EncodeLayer(*MakeEmptyLayer(SpecOf(LayerKind::kScalar)), &scalar);
  EXPECT_TRUE(scalar.properties().has_cells());
  EXPECT_FALSE(scalar.properties().has_shapes());
  EXPECT_EQ(scalar.properties().unit(), "dBm");
  EXPECT_FALSE(scalar.properties().has_value_range());
  v1::Layer occupancy;
  EncodeLayer(*MakeEmptyLayer(SpecOf(LayerKind::kOccupancy)), &occupancy);
  EXPECT_EQ(occupancy.properties().value_range().min(), 0.0);
  EXPECT_EQ(occupancy.properties().value_range().max(), 1.0);
  EXPECT_FALSE(occupancy.properties().is_binary());
  EXPECT_THAT(occupancy.properties().words(), Contains("free"));
  v1::Layer exploration;
  EncodeLayer(*MakeEmptyLayer(SpecOf(LayerKind::kExploration)), &exploration);
  EXPECT_TRUE(exploration.properties().is_binary());
  EXPECT_THAT(exploration.properties().words(), Contains("unexplored"));
  ASSERT_EQ(exploration.properties().words_of_values_size(), 2);
  EXPECT_EQ(exploration.properties().words_of_values(1).word(), "explored");
  EXPECT_EQ(exploration.properties().words_of_values(1).value(), 1.0);
}

TEST(LayerOnTheWire, ThresholdsLeftOutAreTheDefaults) {
  v1::Layer message;
  message.set_kind(v1::LAYER_KIND_OCCUPANCY);
  message.mutable_thresholds()->set_free_below(0.01);
  const auto decoded = DecodeLayerSpec("layer", message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->thresholds.free_below, 0.01);
  EXPECT_EQ(decoded->thresholds.occupied_above, OccupancyThresholds().occupied_above);
}

TEST(LayerOnTheWire, BadOnesNameTheField) {
  v1::Layer message;
  EXPECT_EQ(DecodeLayerSpec("layer", message).status(),
            absl::InvalidArgumentError("layer.kind is missing"));
  message.set_kind(static_cast<v1::LayerKind>(77));
  EXPECT_EQ(DecodeLayerSpec("layer", message).status(),
            absl::InvalidArgumentError("layer.kind is not a known kind: 77"));
  message.set_kind(v1::LAYER_KIND_EXPLORATION);
  message.set_explored_rule(static_cast<v1::CellRule>(9));
  EXPECT_EQ(DecodeLayerSpec("layer", message).status(),
            absl::InvalidArgumentError("layer.explored_rule is not a known rule: 9"));
  message.clear_explored_rule();
  message.set_kind(v1::LAYER_KIND_SEMANTIC);
  for (const char* alias : {"tv", "sofa", "tv"}) message.add_aliases()->set_alias(alias);
  EXPECT_EQ(DecodeLayerSpec("layer", message).status(),
            absl::InvalidArgumentError("layer.aliases[2].alias stands there twice"));
  message.clear_aliases();
  message.add_shape_kinds(v1::SHAPE_KIND_POINT);
  message.add_shape_kinds(static_cast<v1::ShapeKind>(8));
  EXPECT_EQ(DecodeLayerSpec("layer", message).status(),
            absl::InvalidArgumentError("layer.shape_kinds[1] is not a known kind: 8"));
  message.clear_shape_kinds();
  message.set_kind(v1::LAYER_KIND_SCALAR);
  message.mutable_grid()->mutable_origin()->set_x(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(DecodeLayerSpec("layer", message).status(),
            absl::InvalidArgumentError("layer.grid.origin is not finite"));
}

TEST(LayerOnTheWire, TellsItsSizeExtentAndVersion) {
  EditBatch batch;
  LayerSpec spec = SpecOf(LayerKind::kOccupancy);
  batch.edits.push_back(CreateLayer{spec});
  batch.edits.push_back(
      WriteCells{spec.name, {-1, 1, 5, 8}, std::vector<std::optional<double>>(6, 0.5)});
  spec.name = "empty";
  batch.edits.push_back(CreateLayer{spec});
  const Snapshot snapshot = hypermap::testing::MakeSnapshot("site", batch);

  v1::Layer written;
  EncodeLayer(**snapshot.GetLayer("a-layer"), &written, 17);
  EXPECT_EQ(written.size(), 6);
  EXPECT_EQ(written.version(), 17);
  EXPECT_EQ(DecodeCellBox(written.extent()), (CellBox{-1, 1, 5, 8}));

  v1::Layer empty;
  EncodeLayer(**snapshot.GetLayer("empty"), &empty, 1);
  EXPECT_EQ(empty.size(), 0);
  EXPECT_FALSE(empty.has_extent());
}

}  // namespace
}  // namespace hypermap::wire
