#include "storage/geopackage/map_check.h"

#include <algorithm>
#include <filesystem>
#include <ostream>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/conformance/testing/recorded_map.h"
#include "storage/geopackage/map_repair.h"
#include "storage/geopackage/testing/map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr size_t kPageBytes = 4096;

std::string AllOf(const CheckReport& report) {
  std::string text;
  for (const Finding& finding : report.findings) absl::StrAppend(&text, Describe(finding), "\n");
  return text;
}

bool Has(const CheckReport& report, const Finding& like) {
  return std::any_of(report.findings.begin(), report.findings.end(), [&](const Finding& found) {
    return found.table == like.table && found.row == like.row &&
           absl::StrContains(found.problem, like.problem) &&
           found.can_be_rebuilt == like.can_be_rebuilt;
  });
}

CheckReport Check(const std::string& path) {
  absl::StatusOr<CheckReport> report = CheckMapFile(path, nullptr);
  EXPECT_TRUE(report.ok()) << report.status();
  return report.ok() ? *std::move(report) : CheckReport();
}

// Makes a map with two objects, of which the second is there at the end, a tile, a transform, and a
// history of two revisions.
EditedMap MakeMap(MapStore& store) {
  EditedMap map = CreateMap(store, "site");
  map.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""},
             PutObject{"s", UnitSquare("table"), ""},
             CreateLayer{GridSpec("g", LayerKind::kOccupancy, {}, 0.05)},
             WriteCells{"g", {0, 1, 0, 1}, {0.5}}, SetTransform{{"map", "robot", {}}}}});
  map.Edit({{DeleteObject{"s", 1}, WriteCells{"g", {0, 1, 0, 1}, {0.25}},
             SetAliases{"s", {{"seat", {"chair"}}}}}});
  return map;
}

class MapCheckTest : public ::testing::Test {
 protected:
  MapCheckTest() { MakeMap(*OpenStore(folder_.path())); }

  void Damage(const std::string& sql) {
    const auto other = Connect(path_);
    ASSERT_TRUE(other->Execute("PRAGMA foreign_keys = OFF").ok());
    const absl::Status status = other->Execute(sql);
    ASSERT_TRUE(status.ok()) << status;
  }

  const testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "site.gpkg";
};

TEST_F(MapCheckTest, CleanMapHasNoFindingsAndIsNotTouched) {
  const std::string before = ReadFile(path_);
  const CheckReport report = Check(path_);
  EXPECT_THAT(report.findings, IsEmpty()) << AllOf(report);
  EXPECT_EQ(report.revision, 2);
  EXPECT_EQ(ReadFile(path_), before);
  EXPECT_FALSE(std::filesystem::exists(path_ + "-wal"));
  EXPECT_FALSE(std::filesystem::exists(path_ + "-shm"));
}

TEST_F(MapCheckTest, RandomMapsWithHistoryAreClean) {
  const uint64_t seed = ::hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  ::hypermap::testing::Rng rng(seed);
  const auto store = OpenStore(folder_.path());
  EditedMap map = CreateMap(*store, "random");
  map.Edit(::hypermap::testing::RandomSite(rng, 30));
  for (int i = 0; i < 10; ++i) map.Edit(RandomBatch(rng, *map.snapshot));
  ASSERT_TRUE(map.stored->Compact(2, absl::InfinitePast(), 7).ok());
  const auto check = map.stored->OpenCheck();
  ASSERT_TRUE(check.ok()) << check.status();
  const auto report = (*check)->Run(nullptr);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_THAT(report->findings, IsEmpty()) << AllOf(*report);
}

TEST_F(MapCheckTest, MapIsCheckedWhileItIsEdited) {
  const auto store = OpenStore(folder_.path());
  EditedMap map = CreateMap(*store, "other");
  map.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}});
  const auto check = map.stored->OpenCheck();
  ASSERT_TRUE(check.ok()) << check.status();
  map.Edit({{PutObject{"s", UnitSquare("table"), ""}}});
  const auto report = (*check)->Run(nullptr);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_THAT(report->findings, IsEmpty()) << AllOf(*report);
  EXPECT_EQ(report->revision, 2);
}

TEST_F(MapCheckTest, AllDamageIsReported) {
  Damage(
      "UPDATE s SET label = '' WHERE id = 2; UPDATE g SET tile_data = zeroblob(9); "
      "DELETE FROM rtree_s_geom; DELETE FROM hypermap_revisions WHERE revision = 1");
  const CheckReport report = Check(path_);
  EXPECT_TRUE(Has(report, {"s", "id 2", "object.label"})) << AllOf(report);
  EXPECT_TRUE(Has(report, {"g", "id 1", "PNG"})) << AllOf(report);
  EXPECT_TRUE(Has(report, {"rtree_s_geom", "id 2", "not in the index", true})) << AllOf(report);
  EXPECT_TRUE(Has(report, {"hypermap_revisions", "revision 1", "missing"})) << AllOf(report);
}

TEST_F(MapCheckTest, PageThatIsOverwrittenIsFoundAndNothingIsRepaired) {
  const std::string intact = ReadFile(path_);
  int found = 0;
  for (size_t page = 1; page < intact.size() / kPageBytes; ++page) {
    std::string damaged = intact;
    std::fill_n(damaged.begin() + static_cast<int64_t>(page * kPageBytes), kPageBytes, '\xa5');
    WriteFile(path_, damaged);
    const CheckReport report = Check(path_);
    if (report.is_clean()) continue;  // a free page
    ++found;
    const auto repaired = RepairMapFile(path_, nullptr);
    if (repaired.ok()) {  // a page of an index that can be rebuilt
      std::filesystem::remove(CopyPathOf(path_));
      continue;
    }
    EXPECT_EQ(repaired.status().code(), absl::StatusCode::kFailedPrecondition) << page;
    EXPECT_EQ(ReadFile(path_), damaged) << page;
    EXPECT_FALSE(std::filesystem::exists(CopyPathOf(path_))) << page;
  }
  EXPECT_GT(found, 10);
}

TEST_F(MapCheckTest, FileThatIsCutShortIsFound) {
  const std::string intact = ReadFile(path_);
  WriteFile(path_, intact.substr(0, intact.size() - 1));
  EXPECT_FALSE(Check(path_).is_clean());
}

TEST_F(MapCheckTest, WhatIsNoMapCannotBeChecked) {
  WriteFile(folder_ / "text", "no database");
  EXPECT_EQ(CheckMapFile(folder_ / "text", nullptr).status().code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(CheckMapFile(folder_.path(), nullptr).status().code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(CheckMapFile(folder_ / "none", nullptr).status().code(), absl::StatusCode::kNotFound);
  Damage("UPDATE hypermap_metadata SET schema_version = 5");
  const absl::Status older = CheckMapFile(path_, nullptr).status();
  EXPECT_EQ(older.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(older.message()), HasSubstr("is older"));
}

TEST_F(MapCheckTest, RepairKeepsACopyAndTheHistory) {
  Damage("DELETE FROM rtree_s_geom; DELETE FROM hypermap_object_boxes");
  const std::string damaged = ReadFile(path_);
  const auto repaired = RepairMapFile(path_, nullptr);
  ASSERT_TRUE(repaired.ok()) << repaired.status();
  EXPECT_FALSE(repaired->before.is_clean());
  EXPECT_TRUE(repaired->after.is_clean()) << AllOf(repaired->after);
  EXPECT_EQ(ReadFile(repaired->copy), damaged);
  const auto store = OpenStore(folder_.path());
  const auto map = store->Open("site");
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_THAT((*map)->opening_notes(), IsEmpty());
  // A second repair must not lose the first copy.
  EXPECT_TRUE(Connect(path_)->Execute("DELETE FROM rtree_s_geom").ok());
  EXPECT_EQ(RepairMapFile(path_, nullptr).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(MapCheckTest, RepairOfACleanMapWritesNothing) {
  const std::string before = ReadFile(path_);
  const auto repaired = RepairMapFile(path_, nullptr);
  ASSERT_TRUE(repaired.ok()) << repaired.status();
  EXPECT_EQ(repaired->copy, "");
  EXPECT_EQ(ReadFile(path_), before);
}

TEST_F(MapCheckTest, RestoredFileIsAnotherIncarnationOfTheMap) {
  GeoPackageOptions options;
  options.trash_age = absl::Hours(1);
  const auto store = OpenStore(folder_.path(), options);
  auto map = store->Open("site");
  ASSERT_TRUE(map.ok()) << map.status();
  const uint64_t before = (*map)->header().incarnation;
  const std::string copy = folder_ / "copy";
  ASSERT_TRUE((*map)->BackupTo(copy).ok());
  const auto checked = store->CheckFile(copy, nullptr);
  ASSERT_TRUE(checked.ok()) << checked.status();
  EXPECT_TRUE(checked->is_clean()) << AllOf(*checked);
  // The map is open.
  EXPECT_EQ(store->Restore(copy, "site", "r1").code(), absl::StatusCode::kFailedPrecondition);
  map->reset();
  ASSERT_TRUE(store->Restore(copy, "site", "r1").ok());
  map = store->Open("site");
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_NE((*map)->header().incarnation, before);
  EXPECT_EQ((*map)->header().request_id, "r1");
  EXPECT_EQ((*(*map)->Load())->revision, 2);
  EXPECT_FALSE(std::filesystem::exists(copy));
  EXPECT_FALSE(std::filesystem::is_empty(folder_ / "trash"));
}

// After an attempt that could not sync the folder, the file may be the map that was replaced.
TEST_F(MapCheckTest, RestorationThatIsRepeatedDoesNotReplaceTheMapAgain) {
  const auto store = OpenStore(folder_.path());
  const std::string copy = folder_ / "copy";
  ASSERT_TRUE((*store->Open("site"))->BackupTo(copy).ok());
  std::filesystem::copy_file(folder_ / "site.gpkg", folder_ / "earlier");
  ASSERT_TRUE(store->Restore(copy, "site", "r1").ok());
  const uint64_t restored = (*store->Open("site"))->header().incarnation;
  std::filesystem::rename(folder_ / "earlier", copy);
  const absl::Status again = store->Restore(copy, "site", "r1");
  EXPECT_TRUE(again.ok()) << again;
  EXPECT_EQ((*store->Open("site"))->header().incarnation, restored);
}

TEST_F(MapCheckTest, FileOfAnOlderVersionIsMigratedBeforeItIsRestored) {
  const std::string file = folder_ / "old";
  ASSERT_TRUE(Connect(file)->Execute(ReadFile(GEOPACKAGE_TESTDATA "/map_v5.sql")).ok());
  const auto store = OpenStore(folder_.path());
  const auto checked = store->CheckFile(file, nullptr);
  ASSERT_TRUE(checked.ok()) << checked.status();
  EXPECT_TRUE(checked->is_clean()) << AllOf(*checked);
  ASSERT_TRUE(store->Restore(file, "old", "").ok());
  EXPECT_TRUE(store->Open("old").ok());
}

TEST_F(MapCheckTest, EvidenceIsShownToTheCaller) {
  Damage(
      "INSERT INTO hypermap_fusion VALUES (1, 's', 'paper', '', '');"
      "INSERT INTO hypermap_operator_facts VALUES (1, 's', 0, '', -1, 1, 'pin', 't', X'07')");
  EXPECT_TRUE(Check(path_).is_clean()) << AllOf(Check(path_));
  const auto refuse = [](const LogEntry& entry) {
    EXPECT_EQ(entry.key.number, 1);
    EXPECT_EQ(entry.body, "\x07");
    return absl::DataLossError("can't be decoded");
  };
  const auto report = CheckMapFile(path_, refuse);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(Has(*report, {"hypermap_operator_facts", "id 1", "can't be decoded"}))
      << AllOf(*report);
}

// Damage by an SQL statement, and the finding that tells it.
struct MapDamage {
  const char* sql;
  Finding finding;
};

void PrintTo(const MapDamage& damage, std::ostream* out) { *out << damage.sql; }

class FoundDamageTest : public MapCheckTest, public ::testing::WithParamInterface<MapDamage> {};

TEST_P(FoundDamageTest, IsToldAndRepairedIfItCanBe) {
  Damage(GetParam().sql);
  const CheckReport report = Check(path_);
  EXPECT_TRUE(Has(report, GetParam().finding)) << AllOf(report);
  const auto repaired = RepairMapFile(path_, nullptr);
  ASSERT_TRUE(repaired.ok()) << repaired.status();
  EXPECT_EQ(Has(repaired->after, GetParam().finding), !GetParam().finding.can_be_rebuilt)
      << AllOf(repaired->after);
}

INSTANTIATE_TEST_SUITE_P(
    Table, FoundDamageTest,
    ::testing::Values(
        MapDamage{"DELETE FROM rtree_s_geom WHERE id = 2",
                  {"rtree_s_geom", "id 2", "not in the index", true}},
        MapDamage{"UPDATE rtree_s_geom SET maxx = 0.5 WHERE id = 2",
                  {"rtree_s_geom", "id 2", "another box", true}},
        MapDamage{"UPDATE rtree_s_geom SET maxx = 5 WHERE id = 2",
                  {"rtree_s_geom", "id 2", "another box", true}},
        MapDamage{"INSERT INTO rtree_s_geom VALUES (99, 0, 1, 0, 1)",
                  {"rtree_s_geom", "id 99", "no object", true}},
        MapDamage{"UPDATE s SET label = ''", {"s", "id 2", "object.label"}},
        MapDamage{"UPDATE s SET geom = X'00'", {"s", "id 2", "geometry"}},
        MapDamage{"UPDATE s SET version = 77", {"s", "id 2", "no revision"}},
        MapDamage{"UPDATE g SET tile_data = substr(tile_data, 1, 60)", {"g", "id 1", "PNG"}},
        MapDamage{"UPDATE g SET tile_column = tile_column + 1", {"g", "id 1", "extent"}},
        MapDamage{"DELETE FROM g",
                  {"hypermap_changes", "revision 2, number 2", "writes a tile of layer g"}},
        MapDamage{"DELETE FROM s",
                  {"hypermap_changes", "revision 1, number 4", "puts the object 2"}},
        MapDamage{"DELETE FROM hypermap_object_history",
                  {"hypermap_changes", "revision 2, number 1", "removes the object 1"}},
        MapDamage{"DELETE FROM hypermap_object_history",
                  {"hypermap_object_boxes", "id 1", "no such version", true}},
        MapDamage{"UPDATE hypermap_object_history SET tags = '{'",
                  {"hypermap_object_history", "id 1", "column tags"}},
        MapDamage{"UPDATE hypermap_object_history SET end_revision = 9",
                  {"hypermap_object_history", "id 1", "after the newest"}},
        MapDamage{"DELETE FROM hypermap_object_boxes",
                  {"hypermap_object_boxes", "id 1", "has no box", true}},
        MapDamage{"UPDATE hypermap_object_boxes SET max_x = 1",
                  {"hypermap_object_boxes", "id 1", "not that of the version", true}},
        MapDamage{"UPDATE hypermap_tile_history SET tile_data = zeroblob(9) "
                  "WHERE tile_data NOT NULL",
                  {"hypermap_tile_history", "id 2", "PNG"}},
        MapDamage{"DELETE FROM hypermap_tile_history WHERE id = 2",
                  {"hypermap_changes", "revision 2, number 2", "what was there before"}},
        MapDamage{"DELETE FROM hypermap_revisions WHERE revision = 2",
                  {"hypermap_revisions", "revision 2", "missing"}},
        MapDamage{"DELETE FROM hypermap_revisions",
                  {"hypermap_revisions", "revision 1 to 2", "missing"}},
        MapDamage{"UPDATE hypermap_revisions SET time_ns = 1 WHERE revision = 2",
                  {"hypermap_revisions", "revision 2", "time"}},
        MapDamage{"DELETE FROM hypermap_changes WHERE revision = 2 AND number = 1",
                  {"hypermap_revisions", "revision 2", "another number"}},
        MapDamage{"UPDATE hypermap_changes SET detail = '[' WHERE kind = 'aliases'",
                  {"hypermap_changes", "revision 2, number 0", "detail of aliases"}},
        MapDamage{"DELETE FROM hypermap_lineages WHERE name = 's'",
                  {"hypermap_layers", "layer s", "lineage"}},
        MapDamage{"DELETE FROM hypermap_layers WHERE name = 's'",
                  {"hypermap_lineages", "id 1", "no such layer"}},
        MapDamage{"INSERT INTO hypermap_observations VALUES (1, 's', 1, 'r', 1, 0, 0, 0, 1, X'')",
                  {"hypermap_observations", "layer s", "not fused"}},
        MapDamage{"INSERT INTO hypermap_fusion VALUES (1, 's', 'paper', '', '');"
                  "INSERT INTO hypermap_observations "
                  "VALUES (1, 's', 1, 'r', 1, 0, 0, 0, 10, X'00')",
                  {"hypermap_observations", "id 1", ""}},
        MapDamage{"INSERT INTO hypermap_fusion VALUES (1, 's', 'paper', '', '');"
                  "INSERT INTO hypermap_operator_facts VALUES "
                  "(1, 's', 1, '', -1, 2, 'pin', 't', X'07'), "
                  "(2, 's', 2, '', -1, 1, 'pin', 't', X'07')",
                  {"hypermap_operator_facts", "id 2", "out of order"}},
        MapDamage{"INSERT INTO hypermap_fusion_checkpoints "
                  "VALUES (1, 's', 1, 'r', 1, 0, 10, X'00', 0)",
                  {"hypermap_fusion_checkpoints", "id 1", "", true}},
        MapDamage{"INSERT INTO hypermap_fusion_bases VALUES (1, 's', 1, 'r', 1, 0, 0, 10, X'00')",
                  {"hypermap_fusion_bases", "id 1", ""}},
        MapDamage{"INSERT INTO hypermap_fusion_bases VALUES (1, 's', 1, 'r', 1, 0, 0, 10, X'00')",
                  {"hypermap_fusion_bases", "layer s", "not fused"}},
        MapDamage{"INSERT INTO hypermap_forgotten_sequences VALUES (1, 's', 'r', 1, 4)",
                  {"hypermap_forgotten_sequences", "layer s", "no base"}},
        MapDamage{"INSERT INTO hypermap_forgotten_sequences VALUES (1, 's', 'r', 4, 3)",
                  {"hypermap_forgotten_sequences", "id 1", "end before"}},
        MapDamage{"INSERT INTO hypermap_forgotten_sequences "
                  "VALUES (1, 's', 'r', 1, 4), (2, 's', 'r', 4, 5)",
                  {"hypermap_forgotten_sequences", "id 2", "another row"}},
        MapDamage{"INSERT INTO hypermap_forgotten_sequences VALUES (1, 's', 'r', 1, 4);"
                  "INSERT INTO hypermap_observations VALUES (1, 's', 1, 'r', 4, 0, 0, 0, 1, X'')",
                  {"hypermap_forgotten_sequences", "id 1", "forgotten and kept"}}));

}  // namespace
}  // namespace hypermap::storage
