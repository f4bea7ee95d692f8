#include "storage/postgres/map_check.h"

#include <algorithm>
#include <memory>
#include <ostream>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/conformance/testing/evidence_map.h"
#include "storage/conformance/testing/time_mark.h"
#include "storage/libpq/testing/cluster.h"
#include "storage/postgres/testing/database.h"

namespace hypermap::storage::postgres {
namespace {

using ::testing::IsEmpty;

std::string AllOf(const CheckReport& report) {
  std::string text;
  for (const Finding& finding : report.findings) absl::StrAppend(&text, Describe(finding), "\n");
  return text;
}

bool Has(const CheckReport& report, const Finding& like) {
  return std::any_of(report.findings.begin(), report.findings.end(), [&](const Finding& found) {
    return found.table == like.table && found.row == like.row &&
           absl::StrContains(found.problem, like.problem);
  });
}

CheckReport Check(StoredMap& map) {
  const auto check = map.OpenCheck();
  EXPECT_TRUE(check.ok()) << check.status();
  absl::StatusOr<CheckReport> report = (*check)->Run(nullptr);
  EXPECT_TRUE(report.ok()) << report.status();
  return report.ok() ? *std::move(report) : CheckReport();
}

// A map with two objects, of which the second is there at the end, a tile, a transform, evidence,
// and a history of three revisions.
class PostgresCheckTest : public ::testing::Test {
 protected:
  void SetUp() override {
    HYPERMAP_SKIP_WITHOUT_POSTGRES();
    database_ = NewDatabase();
    store_ = OpenStore(database_);
    map_ = CreateMap(*store_, "site");
    map_.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""},
                PutObject{"s", UnitSquare("table"), ""},
                CreateLayer{GridSpec("g", LayerKind::kOccupancy, {}, 0.05)},
                WriteCells{"g", {0, 1, 0, 1}, {0.5}}, SetTransform{{"map", "robot", {}}}}},
              "first");
    map_.Edit({{DeleteObject{"s", 1}, WriteCells{"g", {0, 1, 0, 1}, {0.25}},
                SetAliases{"s", {{"seat", {"chair"}}}}}});
    Commit commit = MakeCommit(*map_.snapshot, {{CreateLayer{SemanticSpec("later")}}});
    commit.fusion = {{.layer = "s",
                      .settings = FusionSettings{"evidence", "{}", ""},
                      .observations = {Logged(Key(1, "a", 1), "body")}}};
    ASSERT_TRUE(map_.stored->Write({commit}).ok());
    ASSERT_TRUE(
        map_.stored->fusion_log()
            .KeepCheckpoint("s", {LogKey{Key(1, "a", 1), 0}, "state", absl::UnixEpoch()}, {})
            .ok());
    ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(10), absl::ZeroDuration()).ok());
    ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(20), absl::ZeroDuration()).ok());
  }

  std::string database_;
  std::unique_ptr<MapStore> store_;
  EditedMap map_;
};

TEST_F(PostgresCheckTest, MapThatIsWholeHasNoFindings) {
  const CheckReport report = Check(*map_.stored);
  EXPECT_THAT(report.findings, IsEmpty()) << AllOf(report);
  EXPECT_EQ(report.revision, 3);
}

TEST_F(PostgresCheckTest, DamageOfOtherMapsIsNotToldAndAMapThatIsGoneIsUnavailable) {
  EditedMap other = CreateMap(*store_, "other");
  other.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}});
  const auto check = other.stored->OpenCheck();
  ASSERT_TRUE(check.ok()) << check.status();
  Execute(database_, "UPDATE hypermap.objects SET label = '' WHERE map = 2");
  EXPECT_THAT(Check(*map_.stored).findings, IsEmpty());
  EXPECT_EQ(Check(*other.stored).findings.size(), 1u);
  other.stored.reset();
  ASSERT_TRUE(store_->Delete("other", "").ok());
  ASSERT_TRUE(store_->RemoveOldTrash(absl::Now()).ok());
  EXPECT_TRUE(absl::IsUnavailable((*check)->Run(nullptr).status()));
}

TEST_F(PostgresCheckTest, AllDamageIsReported) {
  Execute(
      database_,
      "UPDATE hypermap.objects SET label = '' WHERE object_id = 2; "
      "UPDATE hypermap.tiles SET image = ''; DELETE FROM hypermap.revisions WHERE revision = 1; "
      "ALTER TABLE hypermap.time_marks DROP COLUMN boot_id; "
      "UPDATE hypermap.receipts SET object_ids = '\\x80'");
  const CheckReport report = Check(*map_.stored);
  const std::string tile = "lineage 2, tile_row 0, tile_col 0, version ";
  EXPECT_TRUE(Has(report, {"hypermap.objects", "lineage 1, object 2, version 1", "label"}));
  EXPECT_TRUE(Has(report, {"hypermap.tiles", absl::StrCat(tile, 1), "PNG"}));
  EXPECT_TRUE(Has(report, {"hypermap.tiles", absl::StrCat(tile, 2), "PNG"}));
  EXPECT_TRUE(Has(report, {"hypermap.revisions", "revision 1", "missing"}));
  EXPECT_TRUE(Has(report, {"hypermap.time_marks", "", "boot_id"}));
  EXPECT_TRUE(Has(report, {"hypermap.receipts", "request_id first", ""})) << AllOf(report);
}

TEST_F(PostgresCheckTest, GeometryThatIsNotTheShapeIsFound) {
  if (!Cluster::Shared().HasPostgis()) GTEST_SKIP();
  Execute(database_,
          "ALTER TABLE hypermap.objects ALTER COLUMN geom DROP EXPRESSION; "
          "UPDATE hypermap.objects SET geom = ST_MakePoint(1, 2) WHERE object_id = 2");
  const CheckReport report = Check(*map_.stored);
  EXPECT_EQ(report.findings.size(), 1u) << AllOf(report);
  EXPECT_TRUE(Has(report, {"hypermap.objects", "lineage 1, object 2, version 1", "geometry"}));
}

struct Damage {
  const char* sql;
  const char* table;
  const char* row;
  const char* problem;
};

void PrintTo(const Damage& damage, std::ostream* out) { *out << damage.sql; }

class PostgresDamageCheckTest : public PostgresCheckTest,
                                public ::testing::WithParamInterface<Damage> {};

TEST_P(PostgresDamageCheckTest, IsFound) {
  const Damage& damage = GetParam();
  Execute(database_, damage.sql);
  const CheckReport report = Check(*map_.stored);
  EXPECT_TRUE(Has(report, {absl::StrCat("hypermap.", damage.table), damage.row, damage.problem}))
      << AllOf(report);
}

constexpr char kFirstTile[] = "lineage 2, tile_row 0, tile_col 0, version 1";
constexpr char kSecondTile[] = "lineage 2, tile_row 0, tile_col 0, version 2";
constexpr char kEntry[] = "layer s, stamp_ns 1, robot a, sequence 1, number 0";

INSTANTIATE_TEST_SUITE_P(
    Rows, PostgresDamageCheckTest,
    ::testing::Values(
        Damage{"UPDATE hypermap.objects SET attributes = '{' WHERE object_id = 1", "objects",
               "lineage 1, object 1, version 1", "attributes"},
        Damage{"UPDATE hypermap.objects SET bounds = box(point(5, 5), point(6, 6)) "
               "WHERE object_id = 2",
               "objects", "lineage 1, object 2, version 1", "bounds"},
        Damage{"UPDATE hypermap.layer_versions SET parameters = '{' WHERE first_revision = 2",
               "layer_versions", "lineage 1, version 2", ""},
        Damage{"UPDATE hypermap.frame_versions SET x = 'NaN'", "frame_versions",
               "frame robot, version 1", ""},
        Damage{"UPDATE hypermap.changes SET detail = '{' WHERE revision = 1 AND number = 0",
               "changes", "revision 1, number 0", ""},
        Damage{"UPDATE hypermap.time_marks SET passed_ns = 0 WHERE number = 2", "time_marks", "",
               "number 2: time goes back"},
        Damage{"UPDATE hypermap.observations SET body = '\\x00'", "observations", kEntry, ""},
        Damage{"UPDATE hypermap.fusion_checkpoints SET state_size = 7", "fusion_checkpoints",
               kEntry, ""}));

INSTANTIATE_TEST_SUITE_P(
    History, PostgresDamageCheckTest,
    ::testing::Values(
        Damage{"UPDATE hypermap.maps SET revision = 6", "revisions", "revision 4 to 6", "missing"},
        Damage{"UPDATE hypermap.maps SET revision = 2", "revisions", "revision 3", "newer"},
        Damage{"UPDATE hypermap.revisions SET time_ns = 0 WHERE revision = 2", "revisions",
               "revision 2", "time"},
        Damage{"DELETE FROM hypermap.changes WHERE kind = 'remove'", "revisions", "revision 2",
               "another number of changes"},
        Damage{"DELETE FROM hypermap.changes WHERE kind = 'remove'", "objects",
               "lineage 1, object 1, version 1", "no change has ended"},
        Damage{"DELETE FROM hypermap.changes WHERE kind = 'put'", "objects",
               "lineage 1, object 2, version 1", "no change has made"},
        Damage{"DELETE FROM hypermap.objects WHERE object_id = 1", "changes",
               "revision 2, number 1", "removes the object 1"},
        Damage{"DELETE FROM hypermap.objects WHERE object_id = 2", "changes",
               "revision 1, number 4", "puts the object 2"},
        Damage{"UPDATE hypermap.objects SET end_revision = 1 WHERE object_id = 1", "objects",
               "lineage 1, object 1, version 1", "ends before it begins"},
        Damage{"UPDATE hypermap.maps SET next_object_id = 2", "objects", "lineage 1, object 2",
               "never assigned"},
        Damage{"UPDATE hypermap.tiles SET first_revision = 1 WHERE first_revision = 2", "tiles",
               kFirstTile, "begins before this one ends"},
        Damage{"DELETE FROM hypermap.changes WHERE kind = 'tile' AND revision = 2", "tiles",
               kSecondTile, "no change has made"},
        Damage{"DELETE FROM hypermap.tiles WHERE first_revision = 2", "changes",
               "revision 2, number 2", "not there"},
        Damage{"DELETE FROM hypermap.lineages WHERE lineage = 2", "tiles", kFirstTile,
               "no such layer"},
        Damage{"UPDATE hypermap.lineages SET end_revision = 2 WHERE lineage = 1", "objects",
               "lineage 1, object 2, version 1", "layer was deleted"},
        Damage{"UPDATE hypermap.lineages SET name = 's'", "lineages", "lineage 1", "same time"},
        Damage{"UPDATE hypermap.receipts SET revision = 9", "receipts", "request_id first",
               "newer"},
        Damage{"DELETE FROM hypermap.fusion", "observations", "layer s", "not fused"}));

}  // namespace
}  // namespace hypermap::storage::postgres
