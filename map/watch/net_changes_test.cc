#include "map/watch/net_changes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

constexpr int kNumTiles = 3;

// A map with the empty grid "floor", and a commit that writes tiles in which all neighbours in a
// row differ.
class TileDifferenceTest : public ::testing::Test {
 protected:
  static StructurePtr Floor() {
    LayerSpec floor{.name = "floor", .kind = LayerKind::kOccupancy};
    floor.grid = GridGeometry{PlanarTransform(), 1.0};
    return StructureOf(testing::MakeSnapshot("m", {{CreateLayer{floor}}}));
  }
  static std::vector<Change> Stripes() {
    TileCodes codes;
    for (int32_t i = 0; i < kCellsPerTile; ++i) codes[i] = i % 2 == 0 ? 0.0f : 1.0f;
    std::vector<Change> changes;
    for (int32_t i = 0; i < kNumTiles; ++i) {
      changes.push_back(TileWritten{"floor", {0, i}, nullptr, Tile::Make(codes)});
    }
    return changes;
  }

  NetChanges::Reader Read(const std::vector<Change>& changes) const {
    NetChanges net;
    net.Add(changes);
    return std::move(net).Read(structure_, structure_, {}, "map");
  }

  const StructurePtr structure_ = Floor();
};

TEST_F(TileDifferenceTest, TilesAreToldOneByOneAndThenDropped) {
  std::vector<Change> changes = Stripes();
  std::vector<std::weak_ptr<const Tile>> tiles;
  for (const Change& change : changes) tiles.push_back(std::get<TileWritten>(change).after);
  NetChanges::Reader difference = Read(changes);
  changes.clear();
  int told = 0;
  while (!difference.done()) {
    const auto change = difference.Next();
    ASSERT_TRUE(change.ok()) << change.status();
    if (!*change) continue;
    ++told;
    EXPECT_EQ((*change)->kind, ChangeKind::kCells);
    EXPECT_EQ((*change)->cells.size(), static_cast<size_t>(kCellsPerTile));
    EXPECT_EQ((*change)->cells_before.size(), static_cast<size_t>(kTileSide));
    const auto kept =
        std::count_if(tiles.begin(), tiles.end(), [](const auto& tile) { return !tile.expired(); });
    EXPECT_EQ(kept, kNumTiles - told);
  }
  EXPECT_EQ(told, kNumTiles);
}

TEST_F(TileDifferenceTest, IsGivenUpAtEachTile) {
  const std::vector<Change> changes = Stripes();
  const int times = TimesCancelled([&] {
    NetChanges::Reader difference = Read(changes);
    while (!difference.done()) {
      const auto change = difference.Next();
      if (!change.ok()) return change.status();
    }
    return absl::OkStatus();
  });
  EXPECT_GE(times, kNumTiles);
}

}  // namespace
}  // namespace hypermap
