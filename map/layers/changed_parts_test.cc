#include "map/layers/changed_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "map/layers/layer_registry.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::Rng;
using testing::TestSeed;
using testing::UniformInt;

using GridPtr = std::shared_ptr<const GridLayer>;

GridPtr EmptyGrid() {
  LayerSpec spec;
  spec.name = "grid";
  spec.kind = LayerKind::kOccupancy;
  spec.frame_id = "map";
  spec.grid = GridGeometry{};
  return std::dynamic_pointer_cast<const GridLayer>(MakeEmptyLayer(spec));
}

GridPtr Write(const GridPtr& grid, const CellBox& box, std::optional<double> value) {
  GridWriter writer(grid);
  EXPECT_TRUE(writer.Write(box, std::vector<std::optional<double>>(box.num_cells(), value)).ok());
  return std::move(writer).Finish().layer;
}

TEST(ChangedParts, AreTheBoxesAroundWhatChangedInEachTile) {
  const GridPtr before = Write(EmptyGrid(), {0, 10, 0, 10}, 0.5);
  const GridPtr after = Write(Write(before, {3, 5, 4, 9}, 0.0), {-2, 1, 300, 301}, 1.0);
  EXPECT_THAT(ChangedParts(*before, *after, kAllCells),
              ElementsAre(CellBox{-2, 0, 300, 301}, CellBox{3, 5, 4, 9}, CellBox{0, 1, 300, 301}));
  EXPECT_THAT(ChangedParts(*before, *after, {4, 100, 0, 6}), ElementsAre(CellBox{4, 5, 4, 6}));
  EXPECT_THAT(ChangedParts(*before, *after, {}), IsEmpty());
}

TEST(ChangedParts, AreNoneWhereTheSameWasWrittenOrNothing) {
  const GridPtr before = Write(EmptyGrid(), {0, 10, 0, 10}, 0.5);
  EXPECT_THAT(ChangedParts(*before, *before, kAllCells), IsEmpty());
  EXPECT_THAT(ChangedParts(*before, *Write(before, {2, 4, 2, 4}, 0.5), kAllCells), IsEmpty());
  EXPECT_THAT(
      ChangedParts(*EmptyGrid(), *Write(EmptyGrid(), {2, 4, 2, 4}, std::nullopt), kAllCells),
      IsEmpty());
}

TEST(ChangedParts, ATileThatComesOrGoesChangesWhatIsKnownOfIt) {
  const GridPtr some = Write(EmptyGrid(), {7, 9, -3, -1}, 0.5);
  EXPECT_THAT(ChangedParts(*EmptyGrid(), *some, kAllCells), ElementsAre(CellBox{7, 9, -3, -1}));
  EXPECT_THAT(ChangedParts(*some, *EmptyGrid(), kAllCells), ElementsAre(CellBox{7, 9, -3, -1}));
}

// Returns the tiles in which a cell of `within` differs, by comparing every cell.
std::set<TileIndex> TilesThatDiffer(const GridLayer& a, const GridLayer& b, const CellBox& within) {
  std::set<TileIndex> tiles;
  for (int32_t row = within.row_begin; row < within.row_end; ++row) {
    for (int32_t col = within.col_begin; col < within.col_end; ++col) {
      if (a.ValueAt({row, col}) != b.ValueAt({row, col})) tiles.insert(TileOf({row, col}));
    }
  }
  return tiles;
}

TEST(ChangedParts, FindEachCellThatDiffersOfRandomGrids) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  const auto random_box = [&rng] {
    const int row = UniformInt(rng, -150, 150);
    const int col = UniformInt(rng, -150, 150);
    return CellBox{row, row + UniformInt(rng, 1, 40), col, col + UniformInt(rng, 1, 40)};
  };
  GridPtr before = EmptyGrid();
  for (int i = 0; i < 15; ++i) {
    GridPtr after = before;
    for (int writes = UniformInt(rng, 0, 3); writes > 0; --writes) {
      after =
          Write(after, random_box(),
                UniformInt(rng, 0, 1) == 0 ? std::nullopt
                                           : std::optional<double>(UniformInt(rng, 0, 2) / 2.0));
    }
    const CellBox within{UniformInt(rng, -160, 0), UniformInt(rng, 1, 190),
                         UniformInt(rng, -160, 0), UniformInt(rng, 1, 190)};
    std::set<TileIndex> found;
    for (const CellBox& part : ChangedParts(*before, *after, within)) {
      EXPECT_TRUE(within.Contains(part));
      EXPECT_THAT(TilesThatDiffer(*before, *after, part),
                  ElementsAre(TileOf({part.row_begin, part.col_begin})));
      found.insert(TileOf({part.row_begin, part.col_begin}));
    }
    EXPECT_EQ(found, TilesThatDiffer(*before, *after, within));
    before = after;
  }
}

}  // namespace
}  // namespace hypermap
