// Damage of a map's history: the error names the damaged row, and the current map still works.
#include <ostream>
#include <string>

#include "base/status/status_macros.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/layers/layer_registry.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

using ::testing::HasSubstr;

// The first error of reading all of the history.
absl::Status ReadAll(HistoryReader& reader) {
  const absl::StatusOr<KeptRevisions> kept = reader.Kept();
  HYPERMAP_RETURN_IF_ERROR(kept.status());
  for (Revision revision = kept->oldest; revision <= kept->newest; ++revision) {
    auto past = reader.At(revision);
    HYPERMAP_RETURN_IF_ERROR(past.status());
    for (const auto& [name, layer] : (*past)->structure()->layers) {
      absl::Status status = IsGridKind(layer.spec.kind)
                                ? (*past)->Tiles(name, kAllCells).status()
                                : (*past)->Objects(name, Box{{0, 0}, {1, 1}}).status();
      HYPERMAP_RETURN_IF_ERROR(status);
    }
  }
  absl::Status status = reader.Commits(kept->oldest, 1000).status();
  status.Update(reader.Revisions(0, 1000, false, 1000).status());
  status.Update(reader.RevisionAt(absl::FromUnixSeconds(1'700'000'001)).status());
  return status;
}

struct HistoryDamage {
  const char* sql;
  const char* message;
};

void PrintTo(const HistoryDamage& damage, std::ostream* out) { *out << damage.sql; }

class DamagedHistoryTest : public ::testing::TestWithParam<HistoryDamage> {};

TEST_P(DamagedHistoryTest, IsToldAndTheMapGoesOn) {
  const testing::TemporaryFolder folder;
  const auto store = OpenStore(folder.path());
  EditedMap map = CreateMap(*store, "site");
  map.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""},
             CreateLayer{GridSpec("g", LayerKind::kOccupancy, {}, 0.05)},
             WriteCells{"g", {0, 1, 0, 1}, {0.5}}, SetTransform{{"map", "robot", {}}}}});
  map.Edit({{DeleteObject{"s", 1}, WriteCells{"g", {0, 1, 0, 1}, {0.25}},
             SetAliases{"s", {{"seat", {"chair"}}}}}});
  auto reader = map.stored->OpenHistory();
  ASSERT_TRUE(reader.ok()) << reader.status();
  ASSERT_TRUE(ReadAll(**reader).ok()) << ReadAll(**reader);
  {
    const absl::Status status = Connect(folder / "site.gpkg")->Execute(GetParam().sql);
    ASSERT_TRUE(status.ok()) << status;
  }
  // Rows that were read before the damage may be cached.
  reader = map.stored->OpenHistory();
  ASSERT_TRUE(reader.ok()) << reader.status();
  const absl::Status status = ReadAll(**reader);
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("map site: "));
  EXPECT_THAT(std::string(status.message()), HasSubstr(GetParam().message));
  EXPECT_TRUE(map.stored->Load().ok());
  map.Edit({{PutObject{"s", UnitSquare("couch"), ""}}});
}

INSTANTIATE_TEST_SUITE_P(
    Table, DamagedHistoryTest,
    ::testing::Values(
        HistoryDamage{"UPDATE hypermap_object_history SET geom = X'00'",
                      "table hypermap_object_history, object 1, version 1: geometry"},
        HistoryDamage{"UPDATE hypermap_object_history SET label = ''", "object.label"},
        HistoryDamage{"UPDATE hypermap_object_history SET tags = '{'", "column tags"},
        HistoryDamage{"UPDATE hypermap_object_history SET existence = 'likely'",
                      "existence holds text"},
        HistoryDamage{"DELETE FROM hypermap_object_history", "object that"},
        HistoryDamage{
            "UPDATE hypermap_tile_history SET tile_data = zeroblob(9) WHERE tile_data NOT NULL",
            "table hypermap_tile_history, tile_column 32768, tile_row 32767: PNG"},
        HistoryDamage{"UPDATE hypermap_tile_history SET tile_data = 'x' WHERE tile_data NOT NULL",
                      "column tile_data holds text"},
        HistoryDamage{"UPDATE hypermap_lineages SET kind = 'voxels'", "unknown kind voxels"},
        HistoryDamage{"UPDATE hypermap_lineages SET table_name = 'gpkg_contents'", "gpkg_contents"},
        HistoryDamage{"UPDATE hypermap_lineages SET table_name = 'none'", "no such table"},
        HistoryDamage{"DELETE FROM hypermap_lineages", "hypermap_lineages has no lineage"},
        HistoryDamage{"UPDATE hypermap_layer_history SET parameters = '['", "parameters"},
        HistoryDamage{"UPDATE hypermap_frame_history SET yaw = 9e999", "hypermap_frame_history"},
        HistoryDamage{"UPDATE hypermap_changes SET kind = 'magic' WHERE kind = 'put'",
                      "hypermap_changes, revision 1: "},
        HistoryDamage{"UPDATE hypermap_changes SET detail = '[' WHERE kind = 'aliases'",
                      "detail of aliases"},
        HistoryDamage{"UPDATE hypermap_changes SET detail = '{}' WHERE kind = 'transform'",
                      "detail of transform"},
        HistoryDamage{"DELETE FROM hypermap_changes WHERE kind = 'tile'", "hypermap_changes has"},
        HistoryDamage{"DELETE FROM hypermap_revisions WHERE revision = 2", "hypermap_revisions"},
        HistoryDamage{"UPDATE hypermap_revisions SET author = X'07'", "author holds"}));

}  // namespace
}  // namespace hypermap::storage
