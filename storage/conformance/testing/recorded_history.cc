#include "storage/conformance/testing/recorded_history.h"

#include <algorithm>
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"

namespace hypermap::storage {

using ::hypermap::testing::Rng;
using ::hypermap::testing::Uniform;
using ::hypermap::testing::UniformInt;

namespace {

void ExpectSameStructure(const MapStructure& actual, const Snapshot& expected) {
  EXPECT_EQ(actual.map_name, expected.map_name);
  EXPECT_EQ(actual.frame_id, expected.frame_id);
  EXPECT_EQ(actual.revision, expected.revision);
  EXPECT_EQ(actual.frames.transforms(), expected.frames.transforms());
  EXPECT_EQ(actual.layers, StructureOf(expected)->layers);
}

// Some part of the layer, which may have nothing in it.
PastMap::Region SomeRegion(Rng& rng, const std::string& name, const Layer& layer) {
  if (AsGrid(&layer) != nullptr) {
    const int32_t row = UniformInt(rng, -400, 300);
    const int32_t col = UniformInt(rng, -400, 300);
    return {name, Box(), {row, row + UniformInt(rng, 1, 300), col, col + UniformInt(rng, 1, 300)}};
  }
  const Point corner{Uniform(rng, -12, 10), Uniform(rng, -12, 10)};
  Box box{corner, {corner.x + Uniform(rng, 0, 6), corner.y + Uniform(rng, 0, 6)}};
  // A box that only touches another at its rim shares points with it.
  const auto objects = dynamic_cast<const SemanticLayer&>(layer).Objects();
  if (!objects.empty() && UniformInt(rng, 0, 2) == 0) {
    const Box& other =
        objects[UniformInt(rng, 0, static_cast<int>(objects.size()) - 1)]->shape.bounds();
    box = {other.max, {other.max.x + 1, other.max.y + 1}};
  }
  return {name, box, CellBox()};
}

void ExpectSameObjectsIn(PastMap& past, const SemanticLayer& expected, const Box& box) {
  auto found = past.Objects(expected.spec().name, box);
  ASSERT_TRUE(found.ok()) << found.status();
  auto next = found->begin();
  for (const ObjectPtr& object : expected.Objects()) {
    const bool is_found = next != found->end() && (*next)->id == object->id;
    if (is_found) {
      EXPECT_TRUE(SameObject(*next++, object));
    } else {
      EXPECT_FALSE(object->shape.bounds().Intersects(box)) << "object " << object->id;
    }
  }
  EXPECT_EQ(next, found->end()) << "objects that were not there";
}

void ExpectSameObjects(PastMap& past, const SemanticLayer& expected) {
  auto all = past.Objects(expected.spec().name);
  ASSERT_TRUE(all.ok()) << all.status();
  const std::vector<ObjectPtr> objects = expected.Objects();
  ASSERT_EQ(all->size(), objects.size());
  for (size_t i = 0; i < objects.size(); ++i) EXPECT_TRUE(SameObject((*all)[i], objects[i]));
}

void ExpectSameTilesIn(PastMap& past, const GridLayer& expected, const CellBox& cells) {
  auto tiles = past.Tiles(expected.spec().name, cells);
  ASSERT_TRUE(tiles.ok()) << tiles.status();
  size_t count = 0;
  for (const auto& [index, tile] : expected.tiles()) {
    if (CellsOf(index).Intersection(cells).empty()) continue;
    ++count;
    const auto found = tiles->find(index);
    ASSERT_NE(found, tiles->end()) << "tile " << index.row << ", " << index.col;
    EXPECT_TRUE(SameTile(found->second, tile)) << "tile " << index.row << ", " << index.col;
  }
  EXPECT_EQ(tiles->size(), count);
}

}  // namespace

void ExpectContentAsRecorded(Rng& rng, PastMap& past, const Snapshot& expected) {
  std::vector<PastMap::Region> regions;
  for (const auto& [name, layer] : expected.layers) {
    regions.push_back(SomeRegion(rng, name, *layer));
  }
  // Whether, and in which order, expected regions are read makes no difference.
  if (UniformInt(rng, 0, 2) > 0) {
    const absl::Status status = past.Expect(regions);
    EXPECT_TRUE(status.ok()) << status;
  }
  if (UniformInt(rng, 0, 2) == 0) std::shuffle(regions.begin(), regions.end(), rng);
  for (const PastMap::Region& region : regions) {
    SCOPED_TRACE(region.layer);
    const LayerPtr& layer = expected.layers.at(region.layer);
    const bool reads_all = UniformInt(rng, 0, 1) == 0;
    if (const auto* grid = AsGrid(layer.get())) {
      ExpectSameTilesIn(past, *grid, region.cells);
      if (reads_all) ExpectSameTilesIn(past, *grid, kAllCells);
    } else {
      const auto& semantic = dynamic_cast<const SemanticLayer&>(*layer);
      ExpectSameObjectsIn(past, semantic, region.box);
      if (reads_all) ExpectSameObjects(past, semantic);
    }
  }
}

void ExpectPastIsAsRecorded(Rng& rng, HistoryReader& reader, const RecordedMap& map,
                            Revision revision) {
  SCOPED_TRACE(::testing::Message() << "revision " << revision);
  auto past = reader.At(revision);
  ASSERT_TRUE(past.ok()) << past.status();
  ExpectSameStructure(*(*past)->structure(), map.at(revision));
  ExpectContentAsRecorded(rng, **past, map.at(revision));
}

void ExpectCommitsAsRecorded(Rng& rng, HistoryReader& reader, const RecordedMap& map,
                             Revision after) {
  while (after < map.newest()) {
    const int max_changes = UniformInt(rng, 1, 40);
    auto commits = reader.Commits(after, max_changes);
    ASSERT_TRUE(commits.ok()) << commits.status();
    ASSERT_FALSE(commits->empty());
    size_t total = 0;
    for (const PastCommit& past : *commits) {
      SCOPED_TRACE(::testing::Message() << "revision " << past.record.revision);
      ASSERT_EQ(past.record.revision, ++after);
      const Commit& commit = map.commit(after);
      EXPECT_EQ(past.record.time, commit.time);
      EXPECT_EQ(past.record.author, commit.author);
      ASSERT_EQ(past.changes.size(), commit.applied.changes.size());
      EXPECT_EQ(past.record.num_changes, static_cast<int64_t>(past.changes.size()));
      for (size_t i = 0; i < past.changes.size(); ++i) {
        EXPECT_TRUE(SameChange(past.changes[i], commit.applied.changes[i]))
            << "change " << i << ", which is a " << commit.applied.changes[i].index();
      }
      total += past.changes.size();
    }
    EXPECT_TRUE(commits->size() == 1 || total <= static_cast<size_t>(max_changes)) << total;
  }
  EXPECT_TRUE(reader.Commits(map.newest(), 1)->empty());
}

void ExpectAllAsRecorded(Rng& rng, HistoryReader& reader, const RecordedMap& map, Revision oldest) {
  auto kept = reader.Kept();
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_EQ(kept->oldest, oldest);
  EXPECT_EQ(kept->newest, map.newest());
  for (Revision r = map.newest(); r >= oldest; --r) ExpectPastIsAsRecorded(rng, reader, map, r);
  ExpectCommitsAsRecorded(rng, reader, map, oldest);
  for (const Revision gone : {oldest - 1, Revision{-1}, map.newest() + 1}) {
    EXPECT_EQ(reader.At(gone).status().code(), absl::StatusCode::kOutOfRange);
    EXPECT_EQ(reader.Commits(gone, 10).status().code(), absl::StatusCode::kOutOfRange);
  }
}

}  // namespace hypermap::storage
