// Damage of a map's history: the error names the damaged row, and the current map still works.
#include <memory>
#include <ostream>
#include <string>

#include "base/status/status_macros.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/layers/layer_registry.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/postgres/testing/database.h"

namespace hypermap::storage::postgres {
namespace {

using ::testing::HasSubstr;

// The first error of reading all of the history.
absl::Status ReadAll(HistoryReader& reader) {
  HYPERMAP_ASSIGN_OR_RETURN(const KeptRevisions kept, reader.Kept());
  for (Revision revision = kept.oldest; revision <= kept.newest; ++revision) {
    HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<PastMap> past, reader.At(revision));
    for (const auto& [name, layer] : past->structure()->layers) {
      const absl::Status status = IsGridKind(layer.spec.kind)
                                      ? past->Tiles(name, kAllCells).status()
                                      : past->Objects(name).status();
      HYPERMAP_RETURN_IF_ERROR(status);
    }
  }
  HYPERMAP_RETURN_IF_ERROR(reader.Commits(kept.oldest, 1000).status());
  HYPERMAP_RETURN_IF_ERROR(reader.Revisions(0, 1000, false, 1000).status());
  return reader.RevisionAt(absl::FromUnixSeconds(1'700'000'001)).status();
}

struct HistoryDamage {
  const char* sql;
  const char* message;
};

void PrintTo(const HistoryDamage& damage, std::ostream* out) { *out << damage.sql; }

class PostgresDamageTest : public ::testing::TestWithParam<HistoryDamage> {};

TEST_P(PostgresDamageTest, IsToldAndTheMapGoesOn) {
  const std::string database = NewDatabase();
  const auto store = OpenStore(database);
  EditedMap map = CreateMap(*store, "site");
  map.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""},
             CreateLayer{GridSpec("g", LayerKind::kOccupancy, {}, 0.05)},
             WriteCells{"g", {0, 1, 0, 1}, {0.5}}, SetTransform{{"map", "robot", {}}}}});
  map.Edit({{DeleteObject{"s", 1}, WriteCells{"g", {0, 1, 0, 1}, {0.25}},
             SetAliases{"s", {{"seat", {"chair"}}}}}});
  auto reader = map.stored->OpenHistory();
  ASSERT_TRUE(reader.ok()) << reader.status();
  ASSERT_TRUE(ReadAll(**reader).ok()) << ReadAll(**reader);
  Execute(database, GetParam().sql);
  // Rows that were read before the damage may be cached.
  reader = map.stored->OpenHistory();
  ASSERT_TRUE(reader.ok()) << reader.status();
  const absl::Status status = ReadAll(**reader);
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("map site: "));
  EXPECT_THAT(std::string(status.message()), HasSubstr(GetParam().message));
  map.Edit({{PutObject{"s", UnitSquare("couch"), ""}}});
}

INSTANTIATE_TEST_SUITE_P(
    Table, PostgresDamageTest,
    ::testing::Values(
        HistoryDamage{"UPDATE hypermap.objects SET shape = overlay(shape PLACING '\\x00' FROM 1)",
                      "hypermap.objects, lineage 1, object 1, version 1: "},
        HistoryDamage{"UPDATE hypermap.objects SET label = ''", "object.label"},
        HistoryDamage{"UPDATE hypermap.objects SET tags = '{'", "column tags"},
        HistoryDamage{"UPDATE hypermap.objects SET height_min = 1", "only one of height_min"},
        HistoryDamage{"DELETE FROM hypermap.objects", "hypermap.changes, revision 1: puts an"},
        HistoryDamage{"UPDATE hypermap.objects SET first_revision = 2", "revision 1: puts an"},
        HistoryDamage{"UPDATE hypermap.tiles SET image = '\\x00'",
                      "hypermap.tiles, lineage 2, tile_row 0, tile_col 0, version 1: PNG"},
        HistoryDamage{"UPDATE hypermap.tiles SET tile_row = 70000;"
                      "UPDATE hypermap.changes SET tile_row = 70000 WHERE kind = 'tile'",
                      "hypermap.tiles has a tile at tile_row 70000"},
        HistoryDamage{"DELETE FROM hypermap.tiles", "a tile that is not there"},
        HistoryDamage{"UPDATE hypermap.lineages SET kind = 'voxels'", "unknown kind voxels"},
        HistoryDamage{"DELETE FROM hypermap.lineages", "hypermap.lineages has no lineage"},
        HistoryDamage{"DELETE FROM hypermap.layer_versions", "hypermap.lineages, lineage "},
        HistoryDamage{"UPDATE hypermap.layer_versions SET parameters = '['", "parameters"},
        HistoryDamage{"UPDATE hypermap.frame_versions SET yaw = 'Infinity'",
                      "hypermap.frame_versions, frame robot: the transform is not finite"},
        HistoryDamage{"UPDATE hypermap.changes SET kind = 'magic' WHERE kind = 'put'",
                      "hypermap.changes, revision 1: "},
        HistoryDamage{"UPDATE hypermap.changes SET detail = '[' WHERE kind = 'aliases'",
                      "detail of aliases"},
        HistoryDamage{"DELETE FROM hypermap.changes WHERE kind = 'tile'", "hypermap.changes has"},
        HistoryDamage{"DELETE FROM hypermap.revisions WHERE revision = 1", "hypermap.revisions"},
        HistoryDamage{"DELETE FROM hypermap.revisions WHERE revision = 2", "hypermap.revisions"}));

}  // namespace
}  // namespace hypermap::storage::postgres
