// The steps in which snapshots and commits are read for a follower.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "map/edits/apply.h"
#include "map/watch/follower.h"
#include "map/watch/structure.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::IsEmpty;

// A bar below y = -1 with slanted teeth up to y = `height_m`. With a pitch of 0.1 m, no tooth
// contains the centre of a cell of 1 m.
Polygon Comb(int num_teeth, double pitch_m, double height_m) {
  Ring ring{{0, -2}, {num_teeth * pitch_m, -2}, {num_teeth * pitch_m, -1}};
  for (int i = num_teeth - 1; i >= 0; --i) {
    ring.push_back({(i + 0.5) * pitch_m, -1});
    ring.push_back({(i + 0.4) * pitch_m, height_m});
    ring.push_back({(i + 0.3) * pitch_m, -1});
  }
  ring.push_back({0, -1});
  return *Polygon::Make(std::move(ring));
}

// A map with a grid "floor", all cells of whose first two tiles have the value 0.25, and a comb
// whose teeth stand in the first tile. The bounding box of the comb reaches into the second one.
class ReadingStepsTest : public ::testing::Test {
 protected:
  static WriteCells TwoTiles(double value) {
    const CellBox cells{0, kTileSide, 0, 2 * kTileSide};
    return {"floor", cells, std::vector<std::optional<double>>(cells.num_cells(), value)};
  }
  static SnapshotPtr Floor() {
    LayerSpec floor{.name = "floor", .kind = LayerKind::kOccupancy};
    floor.grid = GridGeometry{PlanarTransform(), 1.0};
    return std::make_shared<Snapshot>(
        testing::MakeSnapshot("m", {{CreateLayer{floor}, TwoTiles(0.25)}}));
  }

  // A reader of a commit that changes all cells.
  std::unique_ptr<SelectionReader> ReadCommit() {
    const auto applied = Apply(*map_, {{TwoTiles(0.75)}});
    EXPECT_TRUE(applied.ok()) << applied.status();
    return follower_.ReadCommit(std::make_shared<const std::vector<Change>>(applied->changes),
                                structure_);
  }

  const SnapshotPtr map_ = Floor();
  const StructurePtr structure_ = StructureOf(*map_);
  const Polygon comb_ = Comb(1'280, 0.1, 200.0);
  Follower follower_ = *Follower::Make({.area = comb_}, structure_);
};

TEST_F(ReadingStepsTest, ACommitIsComparedWithALargeAreaInShortSteps) {
  const CancelledAfter never(1'000'000);
  const auto reader = ReadCommit();
  int steps = 0;
  for (; !reader->done(); ++steps) EXPECT_THAT(reader->Next(1'000), IsEmpty());
  EXPECT_GE(steps, 20);
  // The second tile is compared with the same spans.
  EXPECT_LE(steps, 40);
  EXPECT_GE(never.num_looks(), steps);
}

TEST_F(ReadingStepsTest, ACommitIsGivenUpWhenTheWorkIsCancelled) {
  const auto reader = ReadCommit();
  const CancelledAfter cancelled(10);
  for (int i = 0; i < 100; ++i) reader->Next(1'000);
  EXPECT_FALSE(reader->done());
}

TEST_F(ReadingStepsTest, ASelectionOfAReplicaIsComparedInShortSteps) {
  Follower follower =
      *Follower::Make({.area = comb_, .frames = WatchFilter::Frames::kAsStored}, structure_);
  const auto reader = follower.Read(map_);
  int steps = 0;
  int64_t num_cells = 0;
  for (; !reader->done(); ++steps) {
    for (const MapChange& told : reader->Next(1'000'000)) {
      for (const CellRun& run : told.cells) num_cells += run.col_end - run.col_begin;
    }
  }
  EXPECT_GE(steps, 20);
  EXPECT_LE(steps, 40);
  EXPECT_EQ(num_cells, kCellsPerTile);
}

std::string Described(const MapChange& change) {
  std::string words =
      absl::StrCat(ChangeKindName(change.kind), " ", change.layer, " ", change.object_id);
  for (const CellRun& run : change.cells) {
    absl::StrAppend(&words, " ", run.row, ":", run.col_begin, "-", run.col_end, "=",
                    run.value.value_or(-1.0));
  }
  return words;
}

using Parts = std::vector<std::vector<std::string>>;

Parts PartsOf(SelectionReader& reader, int max_items) {
  Parts parts;
  while (!reader.done()) {
    std::vector<std::string> part;
    for (const MapChange& change : reader.Next(max_items)) part.push_back(Described(change));
    if (!part.empty()) parts.push_back(std::move(part));
  }
  return parts;
}

// Oracle: reads each change as a commit of its own, and ends a part as soon as it has `max_items`
// objects and runs, or four times as many changes of the commit.
Parts ExpectedParts(Follower& follower, const std::vector<Change>& changes,
                    const StructurePtr& structure, int max_items) {
  Parts parts;
  std::vector<std::string> part;
  size_t items = 0;
  int num_changes = 0;
  for (size_t i = 0; i < changes.size(); ++i) {
    const std::vector<Change> change = {changes[i]};
    const auto reader =
        follower.ReadCommit(std::make_shared<const std::vector<Change>>(change), structure);
    while (!reader->done()) {
      for (const MapChange& told : reader->Next(1'000'000)) {
        part.push_back(Described(told));
        items += told.kind == ChangeKind::kCells ? told.cells.size() : 1;
      }
    }
    ++num_changes;
    const bool ends = items >= static_cast<size_t>(max_items) || num_changes == 4 * max_items;
    if (!ends && i + 1 < changes.size()) continue;
    if (!part.empty()) parts.push_back(std::exchange(part, {}));
    items = 0;
    num_changes = 0;
  }
  return parts;
}

TEST(ReadingStepsPropertyTest, PartsEndAtTheSameChangesWhateverTheSteps) {
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  testing::Rng rng(seed);
  const Polygon comb = Comb(200, 0.05, 8.0);
  const std::vector<WatchFilter> filters = {
      {},
      {.area = testing::RandomPolygon(rng, {0, 0}, 6.0)},
      {.area = comb},
      {.area = comb, .frames = WatchFilter::Frames::kAsStored},
  };
  for (int round = 0; round < 5; ++round) {
    auto map =
        std::make_shared<const Snapshot>(testing::MakeSnapshot("m", testing::RandomSite(rng, 20)));
    StructurePtr structure = StructureOf(*map);
    for (int step = 0; step < 10; ++step) {
      auto applied = Apply(*map, testing::RandomEdits(rng, *map));
      ASSERT_TRUE(applied.ok()) << applied.status();
      map = applied->snapshot;
      const StructurePtr before =
          std::exchange(structure, StructureAfter(structure, map->revision, applied->changes));
      const auto changes = std::make_shared<const std::vector<Change>>(applied->changes);
      for (size_t i = 0; i < filters.size(); ++i) {
        SCOPED_TRACE(absl::StrCat("filter ", i, ", step ", step));
        const int max_items = testing::UniformInt(rng, 1, 30);
        Follower follower = *Follower::Make(filters[i], before);
        const auto reader = follower.ReadCommit(changes, structure);
        if (!reader) continue;  // A reset.
        Follower whole = *Follower::Make(filters[i], structure);
        EXPECT_EQ(PartsOf(*reader, max_items),
                  ExpectedParts(whole, *changes, structure, max_items));
      }
    }
  }
}

}  // namespace
}  // namespace hypermap
