#include "map/edits/difference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "map/edits/apply.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::VariantWith;

// Applies changes one by one, as a store does. Layers that they name get their version in `after`.
class Carrier {
 public:
  Carrier(Snapshot start, const Snapshot& after) : now_(std::move(start)), after_(after) {}

  void operator()(const LayerCreated& change) {
    EXPECT_EQ(now_.FindLayer(change.spec.name), nullptr);
    Set(MakeEmptyLayer(change.spec));
  }
  void operator()(const LayerDeleted& change) {
    EXPECT_EQ(now_.layers.erase(change.spec.name), 1);
    now_.layer_versions.erase(change.spec.name);
  }
  void operator()(const TransformSet& change) {
    EXPECT_TRUE(now_.frames.Set(change.transform).ok());
  }
  void operator()(const AliasesSet& change) {
    const auto& layer = At<SemanticLayer>(change.layer);
    for (const auto& [alias, labels] : change.before) {
      const auto before = layer.spec().aliases.find(alias);
      ASSERT_NE(before, layer.spec().aliases.end());
      EXPECT_EQ(before->second, labels);
    }
    ValueAliases aliases = layer.spec().aliases;
    CarryOut(change, &aliases);
    Set(layer.WithAliases(std::move(aliases)));
  }
  void operator()(const ObjectPut& change) {
    const auto& layer = At<SemanticLayer>(change.layer);
    EXPECT_EQ(layer.Find(change.after->id), change.before);
    Set(layer.With({{change.after->id, change.after}}));
  }
  void operator()(const ObjectRemoved& change) {
    const auto& layer = At<SemanticLayer>(change.layer);
    EXPECT_EQ(layer.Find(change.before->id), change.before);
    Set(layer.With({{change.before->id, nullptr}}));
  }
  void operator()(const TileWritten& change) {
    const auto& grid = At<GridLayer>(change.layer);
    TileMap tiles = grid.tiles();
    tiles[change.index] = change.after;
    Replace(grid, std::move(tiles), grid.extent());
  }
  void operator()(const ExtentGrown& change) {
    const auto& grid = At<GridLayer>(change.layer);
    Replace(grid, grid.tiles(), change.extent);
  }

  const Snapshot& now() const { return now_; }

 private:
  template <typename Kind>
  const Kind& At(const std::string& layer) const {
    return dynamic_cast<const Kind&>(*now_.FindLayer(layer));
  }
  void Replace(const GridLayer& grid, TileMap tiles, const CellBox& extent) {
    Set(std::make_shared<GridLayer>(grid.spec(), grid.shared_domain(), std::move(tiles), extent));
  }
  void Set(LayerPtr layer) {
    const std::string name = layer->spec().name;
    now_.layer_versions[name] = after_.LayerVersionOf(name);
    now_.layers[name] = std::move(layer);
  }

  Snapshot now_;
  const Snapshot& after_;
};

// Returns `before` with the difference to `after` applied.
Snapshot Carry(const Snapshot& before, const Snapshot& after) {
  Carrier carrier(before, after);
  for (const Change& change : Difference(before, after)) std::visit(carrier, change);
  return carrier.now();
}

TEST(DifferenceTest, OfASnapshotToItselfIsNothing) {
  testing::Rng rng(1);
  const Snapshot site = testing::MakeSnapshot("site", testing::RandomSite(rng, 20));
  EXPECT_THAT(Difference(site, site), IsEmpty());
}

TEST(DifferenceTest, ObjectsThatAreEqualDifferByTheirVersion) {
  EditBatch batch;
  batch.edits = {
      CreateLayer{{.name = "objects"}},
      PutObject{"objects", {.label = "chair", .shape = Polygon::FromBox({{0, 0}, {1, 1}})}}};
  const Snapshot before = testing::MakeSnapshot("site", batch);
  EditBatch same;
  same.edits = {PutObject{
      "objects", {.id = 1, .label = "chair", .shape = Polygon::FromBox({{0, 0}, {1, 1}})}}};
  const auto after = Apply(before, same);
  ASSERT_TRUE(after.ok()) << after.status();
  EXPECT_THAT(Difference(before, *after->snapshot),
              ::testing::ElementsAre(VariantWith<ObjectPut>(::testing::_)));
}

TEST(DifferencePropertyTest, LeadsFromOneSnapshotToTheOther) {
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  testing::Rng rng(seed);
  for (int round = 0; round < 20; ++round) {
    const Snapshot before =
        testing::MakeSnapshot("site", testing::RandomSite(rng, testing::UniformInt(rng, 0, 40)));
    SnapshotPtr tip = std::make_shared<Snapshot>(before);
    size_t num_told = 0;
    for (int commit = 0; commit < testing::UniformInt(rng, 1, 8); ++commit) {
      const auto applied = Apply(*tip, testing::RandomEdits(rng, *tip));
      ASSERT_TRUE(applied.ok()) << applied.status();
      num_told += applied->changes.size();
      tip = applied->snapshot;
    }
    const Snapshot& after = *tip;
    EXPECT_LE(Difference(before, after).size(), num_told);
    const Snapshot carried = Carry(before, after);
    EXPECT_EQ(carried.layer_versions, after.layer_versions);
    EXPECT_THAT(Difference(carried, after), IsEmpty());
    EXPECT_THAT(carried.layers, SizeIs(after.layers.size()));
    // And in the other direction.
    EXPECT_THAT(Difference(Carry(after, before), before), IsEmpty());
  }
}

}  // namespace
}  // namespace hypermap
