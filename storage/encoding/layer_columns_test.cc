#include "storage/encoding/layer_columns.h"

#include <functional>
#include <initializer_list>
#include <vector>

#include "gtest/gtest.h"

namespace hypermap::storage {
namespace {

LayerSpec Grid(LayerKind kind) {
  LayerSpec spec;
  spec.name = "grid";
  spec.kind = kind;
  spec.frame_id = "map";
  spec.grid = GridGeometry{PlanarTransform(1.5, -2, 0.1), 0.05};
  return spec;
}

LayerSpec Lanes() {
  LayerSpec spec;
  spec.name = "lanes";
  spec.frame_id = "map";
  spec.aliases = {{"way", {"corridor", "lane"}}};
  spec.shape_kinds = {ShapeKind::kLineString};
  return spec;
}

TEST(LayerColumnsTest, LayersComeBack) {
  LayerSpec occupancy = Grid(LayerKind::kOccupancy);
  occupancy.thresholds = {0.2, 0.7};
  LayerSpec exploration = Grid(LayerKind::kExploration);
  exploration.explored_rule = CellRule::kTouched;
  LayerSpec scalar = Grid(LayerKind::kScalar);
  scalar.unit = "dBm";
  const DecodedLayer layers[] = {
      {occupancy, {-5, 10, 0, 7}}, {exploration, {}}, {scalar, kAllCells}, {Lanes(), {}}};
  for (const DecodedLayer& layer : layers) {
    const absl::StatusOr<LayerColumns> columns = EncodeLayer(layer.spec, layer.extent);
    ASSERT_TRUE(columns.ok()) << columns.status();
    const absl::StatusOr<DecodedLayer> decoded = DecodeLayer(*columns);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(decoded->spec, layer.spec);
    EXPECT_EQ(decoded->extent, layer.extent);
  }
}

TEST(LayerColumnsTest, ParametersAreJsonWithoutDefaults) {
  EXPECT_EQ(*EncodeLayerParameters(LayerSpec()),
            R"({"free_below":0.196,"occupied_above":0.65,"unit":""})");
  EXPECT_EQ(*EncodeLayerParameters(Lanes()),
            R"({"aliases":{"way":["corridor","lane"]},"free_below":0.196,"occupied_above":0.65,)"
            R"("shape_kinds":["line_string"],"unit":""})");
  LayerSpec spec;
  ASSERT_TRUE(DecodeLayerParameters("{}", &spec).ok());
  EXPECT_EQ(spec, LayerSpec());
}

TEST(LayerColumnsTest, OtherColumnsAreRefused) {
  const LayerColumns grid = *EncodeLayer(Grid(LayerKind::kScalar), {0, 1, 0, 1});
  const std::function<void(LayerColumns*)> damages[] = {
      [](LayerColumns* columns) { columns->name = ""; },
      [](LayerColumns* columns) { columns->kind = "elevation"; },
      [](LayerColumns* columns) { columns->kind = "semantic"; },
      [](LayerColumns* columns) { columns->origin_y.reset(); },
      [](LayerColumns* columns) { columns->resolution_m.reset(); },
      [](LayerColumns* columns) { columns->extent.row_end = int64_t{1} << 40; },
      [](LayerColumns* columns) { columns->parameters = "["; },
      [](LayerColumns* columns) { columns->parameters = R"({"explored_rule":"seen"})"; },
      [](LayerColumns* columns) { columns->parameters = R"({"shape_kinds":["cube"]})"; },
  };
  for (size_t i = 0; i < std::size(damages); ++i) {
    LayerColumns columns = grid;
    damages[i](&columns);
    EXPECT_FALSE(DecodeLayer(columns).ok()) << i;
  }
}

}  // namespace
}  // namespace hypermap::storage
