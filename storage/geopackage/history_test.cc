// Compares past revisions that are read from a map's file with recorded snapshots and changes.
#include "storage/geopackage/testing/history.h"

#include <atomic>
#include <limits>
#include <string>
#include <thread>

#include "base/metering/memory_meter.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::Uniform;
using ::hypermap::testing::UniformInt;
using ::testing::HasSubstr;

void ExpectSameStructure(const MapStructure& actual, const Snapshot& expected) {
  EXPECT_EQ(actual.map_name, expected.map_name);
  EXPECT_EQ(actual.frame_id, expected.frame_id);
  EXPECT_EQ(actual.revision, expected.revision);
  EXPECT_EQ(actual.frames.transforms(), expected.frames.transforms());
  EXPECT_EQ(actual.layers, StructureOf(expected)->layers);
}

void ExpectSameObjectsIn(Rng& rng, PastMap& past, const SemanticLayer& expected) {
  const std::string& name = expected.spec().name;
  auto all = past.Objects(name);
  ASSERT_TRUE(all.ok()) << all.status();
  const std::vector<ObjectPtr> objects = expected.Objects();
  ASSERT_EQ(all->size(), objects.size());
  for (size_t i = 0; i < objects.size(); ++i) EXPECT_TRUE(SameObject((*all)[i], objects[i]));
  const Point corner{Uniform(rng, -12, 10), Uniform(rng, -12, 10)};
  Box box{corner, {corner.x + Uniform(rng, 0, 6), corner.y + Uniform(rng, 0, 6)}};
  // A box that only touches another at its rim shares points with it.
  if (!objects.empty() && UniformInt(rng, 0, 2) == 0) {
    const Box& other =
        objects[UniformInt(rng, 0, static_cast<int>(objects.size()) - 1)]->shape.bounds();
    box = {other.max, {other.max.x + 1, other.max.y + 1}};
  }
  auto found = past.Objects(name, box);
  ASSERT_TRUE(found.ok()) << found.status();
  auto next = found->begin();
  for (const ObjectPtr& object : objects) {
    const bool is_found = next != found->end() && (*next)->id == object->id;
    if (is_found) {
      EXPECT_TRUE(SameObject(*next++, object));
    } else {
      EXPECT_FALSE(object->shape.bounds().Intersects(box)) << "object " << object->id;
    }
  }
  EXPECT_EQ(next, found->end()) << "objects that were not there";
}

void ExpectSameTilesIn(Rng& rng, PastMap& past, const GridLayer& expected) {
  const int32_t row = UniformInt(rng, -400, 300);
  const int32_t col = UniformInt(rng, -400, 300);
  const CellBox some{row, row + UniformInt(rng, 1, 300), col, col + UniformInt(rng, 1, 300)};
  for (const CellBox& cells : {some, kAllCells}) {
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
}

void ExpectPastIsAsRecorded(Rng& rng, HistoryReader& reader, const RecordedMap& map,
                            Revision revision) {
  SCOPED_TRACE(::testing::Message() << "revision " << revision);
  auto past = reader.At(revision);
  ASSERT_TRUE(past.ok()) << past.status();
  const Snapshot& expected = map.at(revision);
  ExpectSameStructure(*(*past)->structure(), expected);
  for (const auto& [name, layer] : expected.layers) {
    SCOPED_TRACE(name);
    if (const auto* grid = AsGrid(layer.get())) {
      ExpectSameTilesIn(rng, **past, *grid);
    } else {
      ExpectSameObjectsIn(rng, **past, dynamic_cast<const SemanticLayer&>(*layer));
    }
  }
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

class HistoryTest : public ::testing::Test {
 protected:
  void SetUp() override { store_ = OpenStore(folder_.path()); }
  RecordedMap NewMap() { return RecordedMap(CreateMap(*store_, "site")); }

  testing::TemporaryFolder folder_;
  std::unique_ptr<MapStore> store_;
};

TEST_F(HistoryTest, EveryRevisionAndCommitOfARandomLifeIsAsItWas) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 20)});
  std::unique_ptr<HistoryReader> reader = map.Reader();
  Revision oldest = 0;
  for (int round = 0; round < 4; ++round) {
    while (map.newest() < 12 * (round + 1)) {
      std::vector<EditBatch> group{RandomBatch(rng, map.now())};
      map.Write(group);
    }
    ExpectAllAsRecorded(rng, *reader, map, oldest);
    oldest = UniformInt(rng, static_cast<int>(oldest), static_cast<int>(map.newest()));
    map.Compact(oldest, UniformInt(rng, 1, 100));
    ExpectAllAsRecorded(rng, *reader, map, oldest);
    if (HasFatalFailure()) return;
    if (round != 1) continue;
    reader.reset();
    map.Reopen(*store_);
    reader = map.Reader();
  }
}

TEST_F(HistoryTest, GroupOfCommitsIsAsManyRevisions) {
  Rng rng(5);
  RecordedMap map = NewMap();
  SemanticObject object = UnitSquare("chair");
  EditBatch make{{CreateLayer{SemanticSpec("s")}, PutObject{"s", object, ""}}};
  object.id = 1;
  object.label = "couch";
  EditBatch change{{PutObject{"s", object, ""}}};
  EditBatch remove{{DeleteObject{"s", 1}}};
  EditBatch drop{{DeleteLayer{"s"}}};
  map.Write({make, change, remove, drop, make});
  ExpectAllAsRecorded(rng, *map.Reader(), map, 0);
}

// Allows a number of bytes.
class Allowance : public MemoryAccount {
 public:
  explicit Allowance(int64_t bytes) : bytes_(bytes) {}
  absl::Status ChargeMemory(int64_t bytes) override {
    if (bytes > bytes_) return absl::ResourceExhaustedError("too much");
    bytes_ -= bytes;
    return absl::OkStatus();
  }
  void FreeMemory(int64_t bytes) override { bytes_ += bytes; }

 private:
  int64_t bytes_;
};

TEST_F(HistoryTest, ReadsStopWhereTheirMemoryIsUsedUp) {
  Rng rng(TestSeed());
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 200)});
  while (map.newest() < 10) {
    std::vector<EditBatch> group{RandomBatch(rng, map.now())};
    map.Write(group);
  }
  const std::unique_ptr<HistoryReader> reader = map.Reader();
  const auto read_all = [&](int64_t bytes) {
    Allowance allowance(bytes);
    MemoryMeter meter(&allowance);
    const ScopedMeter here(&meter);
    auto past = reader->At(map.newest() - 1);
    EXPECT_TRUE(past.ok()) << past.status();
    absl::Status status;
    for (const auto& [name, layer] : (*past)->structure()->layers) {
      status.Update(layer.spec.grid ? (*past)->Tiles(name, kAllCells).status()
                                    : (*past)->Objects(name).status());
    }
    past->reset();
    status.Update(reader->Commits(0, 1000).status());
    return std::pair(status, meter.taken());
  };
  const auto [all, bytes] = read_all(int64_t{1} << 30);
  ASSERT_TRUE(all.ok()) << all;
  ASSERT_GT(bytes, MemoryMeter::kFreeBytes);
  const auto [some, at_most] = read_all((bytes - MemoryMeter::kFreeBytes) / 2);
  EXPECT_TRUE(absl::IsResourceExhausted(some)) << some;
  EXPECT_LT(at_most, bytes);
  ExpectAllAsRecorded(rng, *reader, map, 0);
}

TEST_F(HistoryTest, PastMapShowsNothingThatIsWrittenOrForgottenMeanwhile) {
  Rng rng(TestSeed());
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 20)});
  for (int i = 0; i < 5; ++i) map.Write({RandomBatch(rng, map.now())});
  const auto reader = map.Reader();
  auto past = reader->At(3);
  ASSERT_TRUE(past.ok()) << past.status();
  EditBatch drop;
  for (const auto& [name, layer] : map.now().layers) drop.edits.push_back(DeleteLayer{name});
  map.Write({drop});
  map.Compact(map.newest(), 1000);
  for (const auto& [name, layer] : map.at(3).layers) {
    SCOPED_TRACE(name);
    if (const auto* grid = AsGrid(layer.get())) {
      ExpectSameTilesIn(rng, **past, *grid);
    } else {
      ExpectSameObjectsIn(rng, **past, dynamic_cast<const SemanticLayer&>(*layer));
    }
  }
  past->reset();
  EXPECT_EQ(reader->At(3).status().code(), absl::StatusCode::kOutOfRange);
}

TEST_F(HistoryTest, OutOfRangeNamesWhatIsKept) {
  RecordedMap map = NewMap();
  for (int i = 0; i < 5; ++i) map.Write({{{SetTransform{{"map", "dock", {1.0 * i, 0, 0}}}}}});
  map.Compact(3, 100);
  const auto reader = map.Reader();
  EXPECT_THAT(std::string(reader->At(2).status().message()), HasSubstr("the oldest is 3"));
  EXPECT_THAT(std::string(reader->At(6).status().message()), HasSubstr("the newest is 5"));
  // An older revision than before changes nothing; one that does not exist yet means the newest.
  map.Compact(1, 100);
  EXPECT_EQ(reader->Kept()->oldest, 3);
  map.Compact(99, 100);
  EXPECT_EQ(reader->Kept()->oldest, 5);
}

TEST_F(HistoryTest, TimesFindTheirRevision) {
  RecordedMap map = NewMap();
  const auto reader = map.Reader();
  const absl::Time created = HeaderOf("site").created_at;
  EXPECT_EQ(reader->RevisionAt(created - absl::Nanoseconds(1)).status().code(),
            absl::StatusCode::kOutOfRange);
  EXPECT_EQ(*reader->RevisionAt(created), 0);
  EXPECT_EQ(*reader->RevisionAt(absl::InfiniteFuture()), 0);
  for (int i = 0; i < 9; ++i) map.Write({{{SetTransform{{"map", "dock", {1.0 * i, 0, 0}}}}}});
  for (Revision r = 2; r <= 9; ++r) {
    const absl::Time time = map.commit(r).time;
    EXPECT_EQ(*reader->RevisionAt(time), r);
    EXPECT_EQ(*reader->RevisionAt(time + absl::Milliseconds(999)), r);
    EXPECT_EQ(*reader->RevisionAt(time - absl::Nanoseconds(1)), r - 1);
  }
  map.Compact(5, 100);
  EXPECT_EQ(*reader->RevisionAt(map.commit(5).time), 5);
  const absl::Status early = reader->RevisionAt(map.commit(5).time - absl::Nanoseconds(1)).status();
  EXPECT_EQ(early.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(early.message()),
              HasSubstr("revision 5 was made at 2023-11-14T22:13:24"));
}

std::vector<Revision> RevisionsOf(const absl::StatusOr<std::vector<RevisionRecord>>& records) {
  std::vector<Revision> revisions;
  EXPECT_TRUE(records.ok()) << records.status();
  if (!records.ok()) return revisions;
  for (const RevisionRecord& record : *records) revisions.push_back(record.revision);
  return revisions;
}

TEST_F(HistoryTest, RevisionsAreListedInPages) {
  using ::testing::ElementsAre;
  RecordedMap map = NewMap();
  for (int i = 0; i < 9; ++i) map.Write({{{SetTransform{{"map", "dock", {1.0 * i, 0, 0}}}}}});
  const auto reader = map.Reader();
  const Revision end = std::numeric_limits<Revision>::max();
  EXPECT_THAT(RevisionsOf(reader->Revisions(0, end, false, 3)), ElementsAre(1, 2, 3));
  EXPECT_THAT(RevisionsOf(reader->Revisions(3, end, true, 3)), ElementsAre(9, 8, 7));
  EXPECT_THAT(RevisionsOf(reader->Revisions(3, 7, true, 30)), ElementsAre(6, 5, 4));
  EXPECT_THAT(RevisionsOf(reader->Revisions(3, 7, false, 0)), ElementsAre());
  map.Compact(5, 100);
  EXPECT_THAT(RevisionsOf(reader->Revisions(0, 8, false, 30)), ElementsAre(5, 6, 7));
  const auto last = reader->Revisions(8, end, false, 30);
  ASSERT_EQ(last->size(), 1u);
  EXPECT_EQ(last->front().author, "tester");
  EXPECT_EQ(last->front().time, map.commit(9).time);
  EXPECT_EQ(last->front().num_changes, 1);
}

TEST_F(HistoryTest, ListOfRevisionsIsChargedWhileItIsRead) {
  constexpr int kCommits = 2000;
  RecordedMap map = NewMap();
  std::vector<EditBatch> group;
  for (int i = 0; i < kCommits; ++i) {
    group.push_back({{SetTransform{{"map", "dock", {1.0 * i, 0, 0}}}}});
  }
  map.Write(group);
  const auto reader = map.Reader();
  const auto list = [&](int64_t bytes) {
    Allowance allowance(bytes);
    MemoryMeter meter(&allowance);
    const ScopedMeter here(&meter);
    const absl::Status status = reader->Revisions(0, kCommits + 1, false, kCommits).status();
    return std::pair(status, meter.taken());
  };
  const auto [all, bytes] = list(int64_t{1} << 30);
  ASSERT_TRUE(all.ok()) << all;
  EXPECT_GE(bytes, kCommits * static_cast<int64_t>(sizeof(RevisionRecord)));
  const auto [refused, at_most] = list(0);
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_LE(at_most, MemoryMeter::kFreeBytes);
}

TEST_F(HistoryTest, A3AuthorsThatAreNoUtf8AreRepairedWhenTheyAreRead) {
  EditedMap map = CreateMap(*store_, "site");
  map.Edit({{SetTransform{{"map", "dock", {}}}}});
  ASSERT_TRUE(Connect(folder_ / "site.gpkg")
                  ->Execute("UPDATE hypermap_revisions SET author = CAST(X'4BC3FF' AS TEXT)")
                  .ok());
  const auto reader = map.stored->OpenHistory();
  ASSERT_TRUE(reader.ok()) << reader.status();
  constexpr char kRepaired[] = "K\xef\xbf\xbd\xef\xbf\xbd";
  EXPECT_EQ((*reader)->Revisions(0, 9, false, 9)->front().author, kRepaired);
  EXPECT_EQ((*reader)->Commits(0, 9)->front().record.author, kRepaired);
}

TEST_F(HistoryTest, ReceiptsAreForgottenByTheirAgeAndOutliveTheirRevision) {
  EditedMap map = CreateMap(*store_, "site");
  for (int i = 0; i < 6; ++i) {
    map.Edit({{SetTransform{{"map", "dock", {1.0 * i, 0, 0}}}}}, "request " + std::to_string(i));
  }
  // Request i was made at second i.
  const absl::Time limit = absl::FromUnixSeconds(1'700'000'000 + 2);
  ASSERT_TRUE(map.stored->Compact(6, limit, 1000).ok());
  for (int i = 0; i < 6; ++i) {
    const auto receipt = map.stored->FindReceipt("request " + std::to_string(i));
    ASSERT_TRUE(receipt.ok()) << receipt.status();
    EXPECT_EQ(receipt->has_value(), i >= 2) << i;
  }
}

TEST_F(HistoryTest, CompactionLeavesNoRowsThatNobodyCanAskFor) {
  Rng rng(TestSeed());
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 20)});
  for (int i = 0; i < 30; ++i) map.Write({RandomBatch(rng, map.now())});
  EditBatch drop;
  for (const auto& [name, layer] : map.now().layers) drop.edits.push_back(DeleteLayer{name});
  map.Write({drop});
  map.Compact(map.newest(), 7);
  const auto database = Connect(folder_ / "site.gpkg");
  for (const char* table : {"hypermap_object_history", "hypermap_object_boxes",
                            "hypermap_tile_history", "hypermap_changes", "hypermap_lineages",
                            "hypermap_layer_history", "hypermap_layer_revisions"}) {
    EXPECT_EQ(**database->QueryInt64(std::string("SELECT count(*) FROM ") + table), 0) << table;
  }
  EXPECT_EQ(**database->QueryInt64("SELECT count(*) FROM hypermap_revisions"), 1);
  EXPECT_EQ(**database->QueryInt64("SELECT count(*) = (SELECT count(*) FROM hypermap_frames) "
                                   "FROM hypermap_frame_history"),
            1);
}

TEST_F(HistoryTest, BackupKeepsTheHistory) {
  Rng rng(TestSeed());
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 10)});
  for (int i = 0; i < 5; ++i) map.Write({RandomBatch(rng, map.now())});
  const testing::TemporaryFolder elsewhere;
  ASSERT_TRUE(map.stored().BackupTo(elsewhere / "site.gpkg").ok());
  const auto store = OpenStore(elsewhere.path());
  auto copy = store->Open("site");
  ASSERT_TRUE(copy.ok()) << copy.status();
  auto reader = (*copy)->OpenHistory();
  ASSERT_TRUE(reader.ok()) << reader.status();
  ExpectAllAsRecorded(rng, **reader, map, 0);
}

TEST_F(HistoryTest, ReadersDoNotWaitForTheWriter) {
  Rng rng(3);
  GeoPackageOptions impatient;
  impatient.busy_timeout = absl::ZeroDuration();
  store_.reset();
  store_ = OpenStore(folder_.path(), impatient);
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 10)});
  const auto reader = map.Reader();
  auto writer = Connect(folder_ / "site.gpkg");
  ASSERT_TRUE(writer->Execute("BEGIN IMMEDIATE; DELETE FROM hypermap_changes").ok());
  ExpectAllAsRecorded(rng, *reader, map, 0);
  ExpectAllAsRecorded(rng, *map.Reader(), map, 0);
}

TEST_F(HistoryTest, ReadsOfManyThreadsBesideTheWriterAreOfOneRevision) {
  Rng rng(TestSeed());
  RecordedMap map = NewMap();
  EditBatch make{{CreateLayer{SemanticSpec("s")}}};
  for (int i = 0; i < 10; ++i) make.edits.push_back(PutObject{"s", UnitSquare("0"), ""});
  map.Write({make});
  std::atomic<bool> done = false;
  std::atomic<int> reads = 0;
  // Every commit gives all ten objects the label of its revision.
  const auto read = [&](std::unique_ptr<HistoryReader> reader) {
    while (!done || reads < 10) {
      const Revision newest = reader->Kept()->newest;
      auto past = reader->At(newest);
      if (past.status().code() == absl::StatusCode::kOutOfRange) continue;
      ASSERT_TRUE(past.ok()) << past.status();
      auto objects = (*past)->Objects("s", Box{{0, 0}, {1, 1}});
      ASSERT_TRUE(objects.ok()) << objects.status();
      ASSERT_EQ(objects->size(), 10u);
      for (const ObjectPtr& object : *objects) {
        EXPECT_EQ(object->label, std::to_string(newest - 1)) << "revision " << newest;
      }
      ++reads;
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) threads.emplace_back(read, map.Reader());
  for (int i = 1; i <= 30; ++i) {
    EditBatch batch;
    for (ObjectId id = 1; id <= 10; ++id) {
      SemanticObject object = UnitSquare(std::to_string(i));
      object.id = id;
      batch.edits.push_back(PutObject{"s", object, ""});
    }
    map.Write({batch});
    if (i % 7 == 0) map.Compact(map.newest() - 2, 50);
  }
  done = true;
  for (std::thread& thread : threads) thread.join();
}

TEST_F(HistoryTest, ReaderOutlivesTheMapAndLeavesItsFileAlone) {
  Rng rng(3);
  RecordedMap map = NewMap();
  map.Write({{{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}}});
  const auto reader = map.Reader();
  map.Reopen(*store_);
  map.Write({{{DeleteObject{"s", 1}}}});
  ExpectPastIsAsRecorded(rng, *reader, map, 1);
  ASSERT_TRUE(map.Reader()->At(2).ok());
}

}  // namespace
}  // namespace hypermap::storage
