#include "map/watch/carry_out.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "map/edits/apply.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "map/watch/follower.h"
#include "map/watch/structure.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

std::vector<MapChange> ReadChanges(SelectionReader& reader) {
  std::vector<MapChange> told;
  while (!reader.done()) {
    for (MapChange& change : reader.Next(7)) told.push_back(std::move(change));
  }
  return told;
}

// The copy of a map that a subscriber keeps by carrying out what it is told.
class CopyOfMap {
 public:
  CopyOfMap(WatchFilter filter, const SnapshotPtr& map)
      : follower_(*Follower::Make(std::move(filter), StructureOf(*map))) {
    Begin(map);
  }

  void Take(const SnapshotPtr& map, const std::vector<Change>& changes,
            const StructurePtr& structure) {
    const auto reader =
        follower_.ReadCommit(std::make_shared<const std::vector<Change>>(changes), structure);
    if (!reader) return Begin(map);
    Set(CarryOut(*snapshot_, map->revision, ReadChanges(*reader)));
  }

  const Snapshot& snapshot() const { return *snapshot_; }

 private:
  void Begin(const SnapshotPtr& map) {
    Snapshot empty;
    empty.map_name = map->map_name;
    empty.frame_id = map->frame_id;
    Set(CarryOut(std::move(empty), map->revision, ReadChanges(*follower_.Read(map))));
  }
  void Set(absl::StatusOr<SnapshotPtr> snapshot) {
    ASSERT_TRUE(snapshot.ok()) << snapshot.status();
    snapshot_ = *std::move(snapshot);
  }

  Follower follower_;
  SnapshotPtr snapshot_ = std::make_shared<Snapshot>();
};

// A tile without a known cell counts as absent.
TileMap KnownTiles(const GridLayer& grid) {
  auto unknown = std::make_unique<TileCodes>();
  unknown->fill(kUnknownCode);
  TileMap tiles = grid.tiles();
  for (auto tile = tiles.begin(); tile != tiles.end();) {
    tile = tile->second->Holds(*unknown) ? tiles.erase(tile) : std::next(tile);
  }
  return tiles;
}

void ExpectSameCells(const GridLayer& grid, const GridLayer& expected) {
  EXPECT_EQ(grid.extent(), expected.extent());
  const TileMap tiles = KnownTiles(grid);
  const TileMap expected_tiles = KnownTiles(expected);
  ASSERT_EQ(tiles.size(), expected_tiles.size());
  for (const auto& [index, tile] : expected_tiles) {
    const auto found = tiles.find(index);
    ASSERT_NE(found, tiles.end()) << "tile " << index.row << ", " << index.col;
    EXPECT_TRUE(found->second->Holds(tile->codes())) << "tile " << index.row << ", " << index.col;
  }
}

void ExpectSameContent(const Snapshot& map, const Snapshot& expected) {
  EXPECT_EQ(map.revision, expected.revision);
  EXPECT_EQ(map.frame_id, expected.frame_id);
  EXPECT_EQ(map.frames.transforms(), expected.frames.transforms());
  ASSERT_EQ(map.layers.size(), expected.layers.size());
  for (const auto& [name, expected_layer] : expected.layers) {
    SCOPED_TRACE(name);
    const Layer* layer = map.FindLayer(name);
    ASSERT_NE(layer, nullptr);
    EXPECT_EQ(layer->spec(), expected_layer->spec());
    if (const auto* grid = AsGrid(expected_layer.get())) {
      ExpectSameCells(*AsGrid(layer), *grid);
      continue;
    }
    const std::vector<ObjectPtr> objects = AsSemantic(layer)->Objects();
    const std::vector<ObjectPtr> expected_objects = AsSemantic(expected_layer.get())->Objects();
    ASSERT_EQ(objects.size(), expected_objects.size());
    for (size_t i = 0; i < objects.size(); ++i) EXPECT_EQ(*objects[i], *expected_objects[i]);
  }
}

TEST(CarryOutPropertyTest, WhatAFollowerIsToldMakesTheSameMap) {
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE(absl::StrCat("HYPERMAP_TEST_SEED=", seed));
  testing::Rng rng(seed);
  using Frames = WatchFilter::Frames;
  const std::vector<WatchFilter> filters = {
      {.frames = Frames::kAsStored},
      {.classes = {"chair", "cup", "table"}, .frames = Frames::kAsStored},
      {.area = testing::RandomPolygon(rng, {0, 0}, 6.0), .frames = Frames::kAsStored},
      {.layers = {"dock.objects", "exploration", "extra"}, .frames = Frames::kAsStored},
  };
  for (int round = 0; round < 5; ++round) {
    SnapshotPtr map =
        std::make_shared<Snapshot>(testing::MakeSnapshot("m", testing::RandomSite(rng, 20)));
    StructurePtr structure = StructureOf(*map);
    std::vector<CopyOfMap> copies;
    for (const WatchFilter& filter : filters) copies.emplace_back(filter, map);
    for (int step = 0; step < 20; ++step) {
      const auto applied = Apply(*map, testing::RandomEdits(rng, *map));
      ASSERT_TRUE(applied.ok()) << applied.status();
      map = applied->snapshot;
      structure = StructureAfter(structure, map->revision, applied->changes);
      for (size_t i = 0; i < filters.size(); ++i) {
        SCOPED_TRACE(absl::StrCat("filter ", i, ", step ", step));
        copies[i].Take(map, applied->changes, structure);
        ExpectSameContent(copies[i].snapshot(), CopyOfMap(filters[i], map).snapshot());
      }
      // Without a filter, the copy is the map.
      ExpectSameContent(copies[0].snapshot(), *map);
      EXPECT_EQ(copies[0].snapshot().layer_versions, map->layer_versions) << "step " << step;
    }
  }
}

TEST(CarryOutTest, SharesUnchangedLayers) {
  const Snapshot before = testing::MakeSnapshot(
      "m", {{CreateLayer{{.name = "docks"}}, CreateLayer{{.name = "things"}}}});
  auto cup = std::make_shared<SemanticObject>();
  cup->id = 1;
  cup->label = "cup";
  cup->shape = Polygon::FromBox({{0, 0}, {1, 1}});
  const auto after =
      CarryOut(before, 2, {{.kind = ChangeKind::kPut, .layer = "things", .object = cup}});
  ASSERT_TRUE(after.ok()) << after.status();
  EXPECT_EQ((*after)->FindLayer("docks"), before.FindLayer("docks"));
  EXPECT_EQ((*after)->FindSemantic("things")->Find(1), cup);
  EXPECT_EQ((*after)->LayerVersionOf("docks"), 1);
  EXPECT_EQ((*after)->LayerVersionOf("things"), 2);
}

TEST(CarryOutTest, ChangesThatDoNotFitAreRefused) {
  const Snapshot map = testing::MakeSnapshot("m", {{CreateLayer{{.name = "things"}}}});
  const auto code = [&map](MapChange change) {
    return CarryOut(map, 2, {std::move(change)}).status().code();
  };
  using enum absl::StatusCode;
  EXPECT_EQ(code({.kind = ChangeKind::kPut, .layer = "things"}), kInvalidArgument);
  EXPECT_EQ(code({.kind = ChangeKind::kLayerCreated, .layer = "new"}), kInvalidArgument);
  EXPECT_EQ(code({.kind = ChangeKind::kTransform}), kInvalidArgument);
  EXPECT_EQ(code({.kind = ChangeKind::kRemove, .layer = "gone", .object_id = 1}), kNotFound);
  EXPECT_EQ(code({.kind = ChangeKind::kCells,
                  .layer = "things",
                  .cells = {{.row = 0, .col_begin = 0, .col_end = 1, .value = 0.5}}}),
            kFailedPrecondition);
}

// A grid "floor" with cells of 1 m, of which (0, 0) is known.
Snapshot MapWithGrid() {
  LayerSpec floor{.name = "floor", .kind = LayerKind::kScalar};
  floor.grid = GridGeometry{PlanarTransform(), 1.0};
  return testing::MakeSnapshot("m",
                               {{CreateLayer{floor}, WriteCells{"floor", {0, 1, 0, 1}, {0.5}}}});
}

TEST(CarryOutTest, CellsBeyondThoseOfAGridAreRefusedBeforeMemoryIsTaken) {
  const Snapshot map = MapWithGrid();
  constexpr int32_t kMin = std::numeric_limits<int32_t>::min();
  constexpr int32_t kMax = std::numeric_limits<int32_t>::max();
  for (const CellRun& run : {CellRun{0, kMin, kMax, 0.5}, CellRun{kMax, 0, 1, 0.5}}) {
    const MapChange change{.kind = ChangeKind::kCells, .layer = "floor", .cells = {run}};
    EXPECT_EQ(CarryOut(map, 2, {change}).status().code(), absl::StatusCode::kInvalidArgument);
  }
}

TEST(CarryOutTest, ObjectsWithoutAValidIdAreRefused) {
  const Snapshot map = testing::MakeSnapshot("m", {{CreateLayer{{.name = "things"}}}});
  for (const ObjectId id : {ObjectId{0}, ObjectId{-1}, std::numeric_limits<ObjectId>::max()}) {
    auto cup = std::make_shared<SemanticObject>();
    cup->id = id;
    cup->label = "cup";
    cup->shape = Polygon::FromBox({{0, 0}, {1, 1}});
    const MapChange change{.kind = ChangeKind::kPut, .layer = "things", .object = cup};
    EXPECT_EQ(CarryOut(map, 2, {change}).status().code(), absl::StatusCode::kInvalidArgument);
  }
}

TEST(CarryOutTest, ExtentsThatShrinkOrLeaveTheCellsOfAGridAreRefused) {
  const Snapshot map = MapWithGrid();
  constexpr int32_t kMax = std::numeric_limits<int32_t>::max();
  for (const CellBox& extent : {CellBox{5, 6, 5, 6}, CellBox{0, kMax, 0, kMax}}) {
    const LayerStructure floor{map.FindGrid("floor")->spec(), extent, 1};
    const MapChange change{.kind = ChangeKind::kLayerChanged, .layer = "floor", .layer_now = floor};
    EXPECT_EQ(CarryOut(map, 2, {change}).status().code(), absl::StatusCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace hypermap
