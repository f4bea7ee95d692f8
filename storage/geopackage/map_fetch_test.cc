// Tests that objects and tiles which can't be read are fetched from another copy of the map, and
// that nothing is fetched which the map does not have any more.
#include "storage/geopackage/map_fetch.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/conformance/testing/recorded_map.h"
#include "storage/geopackage/map_check.h"
#include "storage/geopackage/map_repair.h"
#include "storage/geopackage/testing/map.h"
#include "storage/sqlite/durable_file.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::UniformInt;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class MapFetchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    store_ = OpenStore(folder_.path());
    map_ = CreateMap(*store_, "site");
    map_.Edit({{CreateLayer{SemanticSpec("things")}, CreateLayer{SemanticSpec("rooms")},
                CreateLayer{GridSpec("wifi", LayerKind::kScalar, {}, 0.25)}}});
    EditBatch batch;
    for (int i = 0; i < 80; ++i) {
      batch.edits.push_back(PutObject{"things", UnitSquare("chair"), ""});
      batch.edits.push_back(PutObject{"rooms", UnitSquare("hall"), ""});
    }
    for (int i = 0; i < 12; ++i) {
      batch.edits.push_back(WriteCells{"wifi", {0, 1, 128 * i, 128 * i + 2}, {-60.5, i + 0.5}});
    }
    map_.Edit(batch);
  }

  void Backup() { ASSERT_TRUE(map_.stored->BackupTo(backup_).ok()); }

  // Closes the map and flips a bit of a page of a table.
  void Damage(Rng& rng, const std::string& table, bool only_leaves = true) {
    map_.stored = nullptr;
    const std::vector<int64_t> pages = PagesOf(path_, table, only_leaves);
    ASSERT_THAT(pages, Not(IsEmpty()));
    FlipBitOfPage(rng, path_, pages[UniformInt(rng, 0, static_cast<int>(pages.size()) - 1)]);
    const auto opened = store_->Open("site");
    ASSERT_TRUE(opened.ok()) << opened.status();
    ASSERT_TRUE(absl::IsDataLoss((*opened)->damage())) << (*opened)->damage();
  }

  absl::StatusOr<FetchReport> Fetch() { return FetchDamaged(path_, backup_, nullptr); }

  // Expects that the map is as it was before the damage, and goes on.
  void ExpectWhole() {
    auto opened = store_->Open("site");
    ASSERT_TRUE(opened.ok()) << opened.status();
    EXPECT_THAT((*opened)->opening_notes(), IsEmpty());
    EXPECT_TRUE((*opened)->damage().ok()) << (*opened)->damage();
    ExpectSame(**(*opened)->Load(), *map_.snapshot);
    map_.stored = *std::move(opened);
    const ObjectId newest = map_.snapshot->FindSemantic("things")->Objects().back()->id;
    map_.Edit({{PutObject{"things", UnitSquare("table"), ""}, DeleteObject{"things", newest},
                WriteCells{"wifi", {0, 1, 0, 1}, {-1.0}}}});
    map_.stored = nullptr;
    const auto report = CheckMapFile(path_, nullptr);
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_THAT(report->findings, IsEmpty());
  }

  // Expects that nothing is done, because of this.
  void ExpectRefused(const std::string& reason) {
    const std::string before = ReadFile(path_);
    const auto report = Fetch();
    EXPECT_TRUE(absl::IsFailedPrecondition(report.status())) << report.status();
    EXPECT_THAT(std::string(report.status().message()), HasSubstr(reason));
    EXPECT_EQ(ReadFile(path_), before);
    for (const char* suffix : {".new", ".work", ".before-repair"}) {
      EXPECT_FALSE(PathExists(path_ + suffix)) << suffix;
    }
  }

  const testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "site.gpkg";
  const std::string backup_ = folder_ / "backup";
  std::unique_ptr<MapStore> store_;
  EditedMap map_;
};

TEST_F(MapFetchTest, RowsThatCantBeReadComeFromABackup) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  Backup();
  // Changes of other rows do not matter: those that were not changed are the damaged ones, or else
  // the repair is refused.
  map_.Edit({{PutObject{"rooms", UnitSquare("kitchen"), ""}}});
  for (const char* table : {"things", "wifi"}) {
    SCOPED_TRACE(table);
    Damage(rng, table);
    const auto report = Fetch();
    ASSERT_TRUE(report.ok()) << report.status();
    ASSERT_EQ(report->layers.size(), 1u);
    EXPECT_EQ(report->layers[0].name, table);
    EXPECT_THAT(report->layers[0].rows, Not(IsEmpty()));
    EXPECT_THAT(report->after.findings, IsEmpty());
    EXPECT_TRUE(PathExists(CopyPathOf(path_)));
    ASSERT_TRUE(RemoveFile(CopyPathOf(path_)).ok());
    ASSERT_TRUE(RemoveFile(backup_).ok());
    ExpectWhole();
    ASSERT_FALSE(HasFailure());
    map_.stored = *store_->Open("site");
    Backup();
  }
}

TEST_F(MapFetchTest, IndexIsBuiltAgainFromTheTable) {
  Rng rng(TestSeed());
  Backup();
  for (const char* index : {"hypermap_things_label", "rtree_things_geom_node"}) {
    SCOPED_TRACE(index);
    Damage(rng, index, /*only_leaves=*/false);
    const auto report = Fetch();
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_THAT(report->layers, IsEmpty());
    ASSERT_TRUE(RemoveFile(CopyPathOf(path_)).ok());
    ExpectWhole();
    map_.stored = *store_->Open("site");
    ASSERT_TRUE(RemoveFile(backup_).ok());
    Backup();
  }
}

TEST_F(MapFetchTest, HistoryIsKept) {
  Rng rng(TestSeed());
  const SnapshotPtr old = map_.snapshot;
  map_.Edit({{DeleteObject{"rooms", 4}, PutObject{"rooms", UnitSquare("hall"), ""}}});
  Backup();
  map_.Edit({{DeleteObject{"rooms", 6}}});
  Damage(rng, "things");
  ASSERT_TRUE(Fetch().ok());
  const auto opened = store_->Open("site");
  ASSERT_TRUE(opened.ok()) << opened.status();
  const auto history = (*opened)->OpenHistory();
  ASSERT_TRUE(history.ok()) << history.status();
  EXPECT_EQ((*history)->Kept()->oldest, 0);
  const auto commits = (*history)->Commits(0, 1000);
  ASSERT_TRUE(commits.ok()) << commits.status();
  EXPECT_EQ(commits->size(), static_cast<size_t>(map_.snapshot->revision));
}

TEST_F(MapFetchTest, WhatWasChangedSinceIsNotFetched) {
  Rng rng(TestSeed());
  Backup();
  EditBatch all;
  for (const ObjectPtr& object : map_.snapshot->FindSemantic("things")->Objects()) {
    PutObject put{"things", UnitSquare("sofa"), ""};
    put.object.id = object->id;
    all.edits.push_back(put);
  }
  map_.Edit(all);
  Damage(rng, "things");
  ExpectRefused("was changed after the copy was made");
}

TEST_F(MapFetchTest, CopyOfAnotherMapIsRefused) {
  Rng rng(TestSeed());
  {
    MapHeader header = HeaderOf("other");
    header.created_at += absl::Seconds(1);
    auto other = store_->Create(header);
    ASSERT_TRUE(other.ok()) << other.status();
    ASSERT_TRUE((*other)->BackupTo(backup_).ok());
  }
  Damage(rng, "things");
  ExpectRefused("copy of another map");
}

TEST_F(MapFetchTest, DamageElsewhereIsRefused) {
  Rng rng(TestSeed());
  Backup();
  Damage(rng, "hypermap_changes");
  ExpectRefused("more is damaged than layers");
}

TEST_F(MapFetchTest, CopyThatIsDamagedItselfIsRefused) {
  Rng rng(TestSeed());
  Backup();
  for (const int64_t page : PagesOf(backup_, "things", /*only_leaves=*/true)) {
    FlipBitOfPage(rng, backup_, page);
  }
  Damage(rng, "things");
  ExpectRefused("can't be read in the copy either");
}

TEST_F(MapFetchTest, FileThatIsNoMapOfThisVersionIsRefused) {
  Rng rng(TestSeed());
  Damage(rng, "things");
  WriteFile(backup_, "not a map");
  ExpectRefused("file is not a database");
  WriteFile(backup_, ReadFile(path_));
  ASSERT_TRUE(Connect(backup_)->Execute("UPDATE hypermap_metadata SET schema_version = 7").ok());
  ExpectRefused("schema version 7 is older");
}

// As after a kill: what the log has is not lost with it.
TEST_F(MapFetchTest, LogBesideTheFileIsPartOfTheMap) {
  Rng rng(TestSeed());
  Backup();
  Damage(rng, "things");
  const testing::TemporaryFolder killed;
  {
    auto opened = store_->Open("site");
    ASSERT_TRUE(opened.ok()) << opened.status();
    const Commit commit =
        MakeCommit(*map_.snapshot, {{PutObject{"rooms", UnitSquare("bath"), ""}}});
    ASSERT_TRUE((*opened)->Write({commit}).ok());
    map_.snapshot = commit.applied.snapshot;
    for (const char* suffix : {"", "-wal"}) {
      WriteFile(killed / "site.gpkg" + suffix, ReadFile(path_ + suffix));
    }
  }
  for (const char* suffix : {"", "-wal"}) {
    WriteFile(path_ + suffix, ReadFile(killed / "site.gpkg" + suffix));
  }
  const auto report = Fetch();
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_FALSE(PathExists(path_ + "-wal"));
  ExpectWhole();
}

// The copy has what was in the log, which is removed first.
TEST_F(MapFetchTest, CopyStaysIfTheFileCantBePutInPlace) {
  Rng rng(TestSeed());
  Backup();
  Damage(rng, "things");
  // In the way of the log's removal.
  std::filesystem::create_directories(path_ + "-journal/folder");
  const std::string before = ReadFile(path_);
  const auto report = Fetch();
  EXPECT_FALSE(report.ok());
  EXPECT_THAT(std::string(report.status().message()), HasSubstr("the file as it was is"));
  EXPECT_EQ(ReadFile(CopyPathOf(path_)), before);
}

TEST_F(MapFetchTest, CopyWithoutTheRowIsRefused) {
  Rng rng(TestSeed());
  // As the file of a replica of another area.
  Backup();
  ASSERT_TRUE(Connect(backup_)->Execute("DELETE FROM things WHERE id > 1").ok());
  Damage(rng, "things");
  ExpectRefused("is not in the copy");
}

}  // namespace
}  // namespace hypermap::storage
