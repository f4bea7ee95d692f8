#include "map/digest/content_digest.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

LayerSpec SemanticSpec() {
  LayerSpec spec;
  spec.name = "things";
  spec.frame_id = "map";
  return spec;
}

LayerSpec GridSpec() {
  LayerSpec spec;
  spec.name = "grid";
  spec.kind = LayerKind::kOccupancy;
  spec.frame_id = "map";
  spec.grid = GridGeometry();
  return spec;
}

SemanticObject Chair() {
  SemanticObject chair;
  chair.id = 7;
  chair.label = "chair";
  chair.classes = {{"chair", 0.75}, {"stool", 0.25}};
  chair.existence = 0.5;
  chair.shape = *Polygon::Make({{{0, 0}, {2, 0}, {2, 1}}});
  chair.tags = {"red"};
  chair.attributes = {{"legs", int64_t{4}}, {"name", "x"}};
  chair.version = 3;
  return chair;
}

std::string DigestOfObject(const SemanticObject& object) {
  return DigestOf(SemanticSpec(), {std::make_shared<const SemanticObject>(object)});
}

std::shared_ptr<const GridLayer> Written(std::shared_ptr<const GridLayer> grid, const CellBox& box,
                                         std::optional<double> value) {
  GridWriter writer(std::move(grid));
  const std::vector<std::optional<double>> values(box.num_cells(), value);
  EXPECT_TRUE(writer.Write(box, values).ok());
  return std::move(writer).Finish().layer;
}

std::shared_ptr<const GridLayer> EmptyGrid() { return AsGrid(MakeEmptyLayer(GridSpec())); }

TEST(ContentDigestTest, EachFieldOfAnObjectCounts) {
  const std::vector<void (*)(SemanticObject&)> changes = {
      [](SemanticObject& o) { o.id = 8; },
      [](SemanticObject& o) { o.label = "chairs"; },
      [](SemanticObject& o) { o.classes["stool"] = 0.26; },
      [](SemanticObject& o) { o.existence = 0.51; },
      [](SemanticObject& o) {
        o.shape = *Polygon::Make({{{0, 0}, {2, 0}, {2, 1.1}}});
      },
      [](SemanticObject& o) {
        o.shape = *Shape::MakePoint({0, 0});
      },
      [](SemanticObject& o) {
        o.height = HeightRange{0, 1};
      },
      [](SemanticObject& o) { o.tags.emplace_back("old"); },
      [](SemanticObject& o) { o.attributes["legs"] = 4.0; },
      [](SemanticObject& o) { o.attributes["name"] = "y"; },
      [](SemanticObject& o) { o.expires_at = absl::UnixEpoch(); },
      [](SemanticObject& o) { o.version = 4; },
  };
  const std::string unchanged = DigestOfObject(Chair());
  EXPECT_EQ(DigestOfObject(Chair()), unchanged);
  for (size_t i = 0; i < changes.size(); ++i) {
    SemanticObject object = Chair();
    changes[i](object);
    EXPECT_NE(DigestOfObject(object), unchanged) << i;
  }
}

TEST(ContentDigestTest, SpecificationOfALayerCounts) {
  LayerSpec spec = SemanticSpec();
  const std::string before = DigestOf(spec, {});
  spec.aliases.insert_or_assign("seat", {"chair"});
  EXPECT_NE(DigestOf(spec, {}), before);
}

TEST(ContentDigestTest, ObjectsCountHoweverTheyCameAbout) {
  testing::Rng rng(7);
  std::map<ObjectId, ObjectPtr> model;
  auto layer = std::make_shared<const SemanticLayer>(SemanticSpec());
  for (int step = 0; step < 3000; ++step) {
    absl::btree_map<ObjectId, ObjectPtr> changes;
    // Now and then many at once, so that runs of all sizes are made and merged.
    const int num_changes = step % 100 == 0 ? 200 : 1;
    for (int i = 0; i < num_changes; ++i) {
      SemanticObject object = testing::RandomObject(rng, {0, 0}, 1);
      object.id = std::uniform_int_distribution<ObjectId>(1, 400)(rng);
      const bool is_removed = std::bernoulli_distribution(0.3)(rng);
      changes[object.id] = is_removed ? nullptr : std::make_shared<const SemanticObject>(object);
    }
    layer = layer->With(changes);
    for (const auto& [id, object] : changes) model[id] = object;
    if (step % 7 != 0) continue;
    std::vector<ObjectPtr> objects;
    for (const auto& [id, object] : model) {
      if (object) objects.push_back(object);
    }
    ASSERT_EQ(DigestOf(*layer), DigestOf(layer->spec(), objects)) << step;
    std::shuffle(objects.begin(), objects.end(), rng);
    ASSERT_EQ(DigestOf(*layer), DigestOf(layer->spec(), objects)) << step;
  }
}

TEST(ContentDigestTest, CellsCountHoweverTheyCameAbout) {
  const CellBox box{0, 200, -3, 5};
  const auto at_once = Written(EmptyGrid(), box, 0.5);
  const auto by_rows = Written(Written(EmptyGrid(), {0, 100, -3, 5}, 0.5), {100, 200, -3, 5}, 0.5);
  EXPECT_EQ(DigestOf(*at_once), DigestOf(*by_rows));
  const auto other = Written(at_once, {7, 8, 4, 5}, 1.0);
  EXPECT_NE(DigestOf(*other), DigestOf(*at_once));
  EXPECT_EQ(DigestOf(*Written(other, {7, 8, 4, 5}, 0.5)), DigestOf(*at_once));
}

TEST(ContentDigestTest, TilesWithoutKnownCellsDontCount) {
  const auto grid = Written(Written(EmptyGrid(), {0, 1, 0, 1}, 0.5), {500, 501, 0, 1}, 0.5);
  const auto erased = Written(grid, {500, 501, 0, 1}, std::nullopt);
  TileMap without = erased->tiles();
  without.erase(TileOf({500, 0}));
  EXPECT_EQ(DigestOf(*erased), DigestOf(erased->spec(), erased->extent(), without));
  EXPECT_NE(DigestOf(*erased), DigestOf(*grid));
}

TEST(ContentDigestTest, PartsThatDifferAreNamed) {
  Snapshot a;
  a.layers["things"] = std::make_shared<SemanticLayer>(SemanticSpec());
  a.layers["grid"] = EmptyGrid();
  EXPECT_THAT(DifferingParts(DigestOf(a), DigestOf(a)), IsEmpty());
  Snapshot b = a;
  b.layers["grid"] = Written(EmptyGrid(), {0, 1, 0, 1}, 0.5);
  EXPECT_THAT(DifferingParts(DigestOf(a), DigestOf(b)), ElementsAre("grid"));
  b.layers.erase("things");
  ASSERT_TRUE(b.frames.Set({"map", "dock", PlanarTransform(1, 0, 0)}).ok());
  EXPECT_THAT(DifferingParts(DigestOf(a), DigestOf(b)), ElementsAre("grid", "things", "frames"));
  EXPECT_THAT(DifferingParts(DigestOf(b), DigestOf(a)), ElementsAre("grid", "things", "frames"));
}

}  // namespace
}  // namespace hypermap
