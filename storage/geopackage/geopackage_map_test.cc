#include "storage/geopackage/geopackage_map.h"

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/layers/semantic_layer.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomCells;
using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;

// Reads the map from disk by a store of its own.
SnapshotPtr Reopen(const testing::TemporaryFolder& folder, const std::string& name) {
  const std::unique_ptr<MapStore> store = OpenStore(folder.path());
  auto map = store->Open(name);
  EXPECT_TRUE(map.ok()) << map.status();
  if (!map.ok()) return nullptr;
  auto snapshot = (*map)->Load();
  EXPECT_TRUE(snapshot.ok()) << snapshot.status();
  return snapshot.ok() ? *snapshot : nullptr;
}

class GeoPackageMapTest : public ::testing::Test {
 protected:
  void SetUp() override {
    store_ = OpenStore(folder_.path());
    map_ = CreateMap(*store_, "site");
  }
  void Close() {
    map_.stored.reset();
    store_.reset();
  }
  void ExpectReopensTheSame() {
    const SnapshotPtr written = map_.snapshot;
    Close();
    const SnapshotPtr read = Reopen(folder_, "site");
    ASSERT_NE(read, nullptr);
    ExpectSame(*read, *written);
  }

  testing::TemporaryFolder folder_;
  std::unique_ptr<MapStore> store_;
  EditedMap map_;
};

TEST_F(GeoPackageMapTest, CommitThatDoesNotFollowTheNewestIsRefused) {
  map_.Edit({{SetTransform{{"map", "a", {}}}}});
  {
    const auto other = Connect(folder_ / "site.gpkg");
    ASSERT_TRUE(other->Execute("UPDATE hypermap_metadata SET revision = 7").ok());
  }
  const Commit commit = MakeCommit(*map_.snapshot, {{SetTransform{{"map", "b", {}}}}});
  EXPECT_EQ(map_.stored->Write({commit}).code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(GeoPackageMapTest, AnotherProgramThatWritesMakesUsUnavailableForAWhile) {
  Close();
  GeoPackageOptions impatient;
  impatient.busy_timeout = absl::ZeroDuration();
  store_ = OpenStore(folder_.path(), impatient);
  map_.stored = *store_->Open("site");
  const auto other = Connect(folder_ / "site.gpkg");
  ASSERT_TRUE(other->Execute("BEGIN IMMEDIATE").ok());
  const Commit commit = MakeCommit(*map_.snapshot, {{SetTransform{{"map", "a", {}}}}});
  EXPECT_EQ(map_.stored->Write({commit}).code(), absl::StatusCode::kUnavailable);
  ASSERT_TRUE(other->Execute("ROLLBACK").ok());
  EXPECT_TRUE(map_.stored->Write({commit}).ok());
}

TEST_F(GeoPackageMapTest, FullDiskStoresNothingAndMayGoAway) {
  Close();
  GeoPackageOptions small;
  small.max_map_bytes = 512 << 10;
  store_ = OpenStore(folder_.path(), small);
  map_.stored = *store_->Open("site");
  Rng rng(7);
  const CellBox box{0, 1024, 0, 1024};
  const Commit large = MakeCommit(
      *map_.snapshot, {{CreateLayer{GridSpec("g", LayerKind::kScalar, {}, 0.05)},
                        WriteCells{"g", box, RandomCells(rng, LayerKind::kScalar, box)}}});
  const absl::Status status = map_.stored->Write({large});
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  ExpectSame(**map_.stored->Load(), *map_.snapshot);
  map_.Edit({{SetTransform{{"map", "a", {}}}}});
  Close();
  store_ = OpenStore(folder_.path());
  map_.stored = *store_->Open("site");
  const Commit retried = MakeCommit(*map_.snapshot, {{CreateLayer{SemanticSpec("g")}}});
  EXPECT_TRUE(map_.stored->Write({retried}).ok());
}

TEST_F(GeoPackageMapTest, ClosedMapIsOneFile) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}}});
  // Another program has the file open meanwhile.
  const auto reader = Connect(folder_ / "site.gpkg");
  ASSERT_TRUE(reader->QueryInt64("SELECT count(*) FROM gpkg_contents").ok());
  map_.stored.reset();
  WriteFile(folder_ / "copy.gpkg", ReadFile(folder_ / "site.gpkg"));
  auto copy = store_->Open("copy");
  ASSERT_TRUE(copy.ok()) << copy.status();
  EXPECT_EQ((*copy)->header().name, "copy");
  Snapshot expected = *map_.snapshot;
  expected.map_name = "copy";
  ExpectSame(**(*copy)->Load(), expected);
}

TEST_F(GeoPackageMapTest, A5_BackupIsGivenUpAndLeavesNoFile) {
  Rng rng(TestSeed());
  map_.Edit(RandomSite(rng, 200));
  {
    CancelledAfter cancelled(3);
    EXPECT_TRUE(absl::IsCancelled(map_.stored->BackupTo(folder_ / "backup.gpkg")));
  }
  for (const char* const end : {"", "-journal", "-wal", "-shm"}) {
    EXPECT_FALSE(std::filesystem::exists(absl::StrCat(folder_ / "backup.gpkg", end)));
  }
  // The last attempt is not cancelled.
  EXPECT_GT(TimesCancelled([&] { return map_.stored->BackupTo(folder_ / "backup.gpkg"); }), 2);
  EXPECT_TRUE(store_->Open("backup").ok());
  map_.Edit({{DeleteLayer{"semantic"}}});
}

TEST_F(GeoPackageMapTest, FreePagesAreNoPartOfABackup) {
  Rng rng(TestSeed());
  map_.Edit(RandomSite(rng, 2000));
  map_.Edit({{DeleteLayer{"semantic"}}});
  while (*map_.stored->Compact(map_.snapshot->revision, absl::InfinitePast(), 100'000)) continue;
  const absl::StatusOr<int64_t> most_bytes = map_.stored->BackupBytes();
  ASSERT_TRUE(map_.stored->BackupTo(folder_ / "backup.gpkg").ok());
  const auto bytes = static_cast<int64_t>(std::filesystem::file_size(folder_ / "backup.gpkg"));
  EXPECT_GE(*most_bytes, bytes);
  EXPECT_LT(*most_bytes, bytes + bytes / 4);
}

TEST_F(GeoPackageMapTest, BackupOfADeletedMapLeavesNoFileOfIt) {
  const absl::StatusOr<std::unique_ptr<MapBackup>> backup = map_.stored->OpenBackup();
  ASSERT_TRUE(backup.ok()) << backup.status();
  map_.stored.reset();
  ASSERT_TRUE(store_->Delete("site", "").ok());
  EXPECT_TRUE((*backup)->WriteTo(folder_ / "backup.gpkg").ok());
  EXPECT_TRUE(store_->Open("backup").ok());
  for (const char* const end : {"", "-wal", "-shm"}) {
    EXPECT_FALSE(std::filesystem::exists(absl::StrCat(folder_ / "site.gpkg", end)));
  }
}

TEST_F(GeoPackageMapTest, BackupHasLittleMoreThanItsContent) {
  Rng rng(TestSeed());
  map_.Edit(RandomSite(rng, 20));
  const absl::StatusOr<int64_t> most_bytes = map_.stored->BackupBytes();
  ASSERT_TRUE(map_.stored->BackupTo(folder_ / "backup.gpkg").ok());
  const auto bytes = static_cast<int64_t>(std::filesystem::file_size(folder_ / "backup.gpkg"));
  EXPECT_LT(*most_bytes, bytes + bytes / 4);
}

TEST_F(GeoPackageMapTest, IndexCoversEveryObject) {
  Rng rng(TestSeed());
  map_.Edit(RandomSite(rng, 60));
  SemanticObject moved = UnitSquare("moved");
  moved.id = 1;
  moved.shape = Polygon::FromBox({{1e7 + 0.1, -1e7 - 0.3}, {1e7 + 0.2, -1e7}});
  const bool in_semantic =
      dynamic_cast<const SemanticLayer&>(*map_.snapshot->FindLayer("semantic")).Find(1) != nullptr;
  map_.Edit({{PutObject{in_semantic ? "semantic" : "dock.objects", moved, ""},
              DeleteObject{in_semantic ? "dock.objects" : "semantic", in_semantic ? 1 : 2}}});
  const auto other = Connect(folder_ / "site.gpkg");
  for (const char* table : {"semantic", "dock_objects"}) {
    const std::string index = absl::StrCat("rtree_", table, "_geom");
    EXPECT_EQ(**other->QueryInt64(absl::StrCat("SELECT count(*) FROM ", table)),
              **other->QueryInt64(absl::StrCat("SELECT count(*) FROM ", index)));
  }
  for (const char* name : {"semantic", "dock.objects"}) {
    const auto& layer = dynamic_cast<const SemanticLayer&>(*map_.snapshot->FindLayer(name));
    const std::string index = absl::StrCat(
        "rtree_", name == std::string("semantic") ? "semantic" : "dock_objects", "_geom");
    for (const ObjectPtr& object : layer.Objects()) {
      const Box& box = object->shape.bounds();
      EXPECT_TRUE(other
                      ->QueryInt64(absl::StrCat("SELECT id FROM ", index,
                                                " WHERE id = ? AND minx <= ? AND maxx >= ? AND "
                                                "miny <= ? AND maxy >= ?"),
                                   object->id, box.min.x, box.max.x, box.min.y, box.max.y)
                      ->has_value())
          << object->id;
    }
  }
}

TEST_F(GeoPackageMapTest, FramesFromBeforeThereWereBoundsStayAndCanBeMended) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}, SetTransform{{"", "half", {}}}}});
  Close();
  constexpr int kDeep = 1000;
  {
    const auto other = Connect(folder_ / "site.gpkg");
    ASSERT_TRUE(other
                    ->Execute("UPDATE hypermap_frames SET x = 1e308, y = 1e308, yaw = 0.5; "
                              "INSERT INTO hypermap_frames (child_frame_id, parent_frame_id, x, y, "
                              "yaw) SELECT 'far', 'half', x, y, yaw FROM hypermap_frames")
                    .ok());
    for (int i = 0; i < kDeep; ++i) {
      const std::string parent = i == 0 ? "map" : absl::StrCat("deep", i - 1);
      ASSERT_TRUE(other
                      ->Run("INSERT INTO hypermap_frames (child_frame_id, parent_frame_id, x, y, "
                            "yaw) VALUES (?, ?, 1, 0, 0)",
                            absl::StrCat("deep", i), parent)
                      .ok());
    }
  }
  store_ = OpenStore(folder_.path());
  auto opened = store_->Open("site");
  ASSERT_TRUE(opened.ok()) << opened.status();
  map_.stored = *std::move(opened);
  auto loaded = map_.stored->Load();
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  map_.snapshot = *loaded;
  const FrameTree& frames = map_.snapshot->frames;
  EXPECT_EQ(frames.size(), kDeep + 2u);
  EXPECT_TRUE(absl::IsInvalidArgument(frames.Lookup("map", "far").status()));
  EXPECT_EQ(frames.Lookup("map", absl::StrCat("deep", kDeep - 1))->x(), kDeep);
  map_.Edit({{SetTransform{{"", "half", {1, 0, 0}}}, SetTransform{{"half", "far", {2, 0, 0}}}}});
  EXPECT_EQ(map_.snapshot->frames.Lookup("map", "far")->x(), 3);
  ExpectReopensTheSame();
}

TEST_F(GeoPackageMapTest, ObjectsAddedByAnotherProgramGetNoIdTwice) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}});
  Close();
  {
    const auto other = Connect(folder_ / "site.gpkg");
    ASSERT_TRUE(other
                    ->Execute("INSERT INTO s (id, geom, label) "
                              "SELECT 41, geom, 'added' FROM s")
                    .ok());
  }
  const SnapshotPtr read = Reopen(folder_, "site");
  ASSERT_NE(read, nullptr);
  EXPECT_EQ(read->next_object_id, 42);
}

}  // namespace
}  // namespace hypermap::storage
