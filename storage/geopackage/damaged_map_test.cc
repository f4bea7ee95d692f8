// Files that are not maps, and damaged maps: the reason is told, and no other map is affected.
#include <filesystem>
#include <ostream>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

absl::Status OpenOf(const std::string& content) {
  const testing::TemporaryFolder folder;
  WriteFile(folder / "site.gpkg", content);
  const auto store = OpenStore(folder.path());
  CreateMap(*store, "other");
  const absl::Status status = store->Open("site").status();
  EXPECT_THAT(std::string(status.message()), HasSubstr("map site: "));
  // The refused file is unchanged, and other maps still work.
  EXPECT_EQ(ReadFile(folder / "site.gpkg"), content);
  EXPECT_TRUE(store->Open("other").ok());
  EXPECT_TRUE(store->Delete("site", "").ok());
  return status;
}

std::string MapBytes() {
  const testing::TemporaryFolder folder;
  {
    const auto store = OpenStore(folder.path());
    ::hypermap::testing::Rng rng(3);
    CreateMap(*store, "site").Edit(::hypermap::testing::RandomSite(rng, 30));
  }
  return ReadFile(folder / "site.gpkg");
}

TEST(ForeignFileTest, IsRefusedWithItsReason) {
  const absl::Status empty = OpenOf("");
  EXPECT_EQ(empty.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(empty.message()), HasSubstr("empty"));
  EXPECT_EQ(OpenOf("a").code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(OpenOf(std::string(100000, 'x')).code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(OpenOf(std::string(100000, '\0')).code(), absl::StatusCode::kFailedPrecondition);
}

TEST(ForeignFileTest, DatabaseThatIsNoGeoPackageIsRefused) {
  const testing::TemporaryFolder folder;
  ASSERT_TRUE(Connect(folder / "x")->Execute("CREATE TABLE t (a)").ok());
  const absl::Status status = OpenOf(ReadFile(folder / "x"));
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("not a GeoPackage"));
}

TEST(ForeignFileTest, GeoPackageThatIsNoMapIsRefused) {
  const testing::TemporaryFolder folder;
  ASSERT_TRUE(Connect(folder / "x")
                  ->Execute("PRAGMA application_id = 0x47504B47; CREATE TABLE gpkg_contents (a)")
                  .ok());
  const absl::Status status = OpenOf(ReadFile(folder / "x"));
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("not a map of Hypermap"));
}

TEST(ForeignFileTest, FolderIsRefused) {
  const testing::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "site.gpkg");
  const auto store = OpenStore(folder.path());
  EXPECT_THAT(*store->List(), ElementsAre("site"));
  EXPECT_EQ(store->Open("site").status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_FALSE(store->Delete("site", "r").ok());
  EXPECT_EQ(*store->FindDeletion("r"), std::nullopt);
  EXPECT_TRUE(std::filesystem::exists(folder / "site.gpkg"));
}

TEST(DamagedFileTest, CutAtAnyPlaceIsRefused) {
  const std::string bytes = MapBytes();
  for (const size_t size : {size_t{99}, size_t{512}, size_t{4095}, size_t{4096}, size_t{5000},
                            bytes.size() / 2, bytes.size() - 4096, bytes.size() - 1}) {
    const absl::Status status = OpenOf(bytes.substr(0, size));
    EXPECT_TRUE(status.code() == absl::StatusCode::kDataLoss ||
                status.code() == absl::StatusCode::kFailedPrecondition)
        << size << ": " << status;
  }
}

TEST(DamagedFileTest, PageThatIsOverwrittenIsFound) {
  const std::string bytes = MapBytes();
  const uint64_t seed = ::hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  ::hypermap::testing::Rng rng(seed);
  int refused = 0;
  for (int i = 0; i < 20; ++i) {
    std::string damaged = bytes;
    const int page = ::hypermap::testing::UniformInt(rng, 1, bytes.size() / 4096 - 1);
    for (int b = 0; b < 4096; ++b) damaged[page * 4096 + b] = static_cast<char>(rng());
    const testing::TemporaryFolder folder;
    WriteFile(folder / "site.gpkg", damaged);
    const auto store = OpenStore(folder.path());
    auto map = store->Open("site");
    absl::Status status = map.ok() ? (*map)->damage() : map.status();
    if (map.ok() && status.ok()) status = DamageFoundByLoad(**map);
    if (status.ok()) continue;  // a free page
    ++refused;
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  }
  EXPECT_GT(refused, 5);
}

// A single flipped byte anywhere in the file gives an answer or an error, but no crash.
TEST(DamagedFileTest, FlippedBytesNeverCrash) {
  const std::string bytes = MapBytes();
  const uint64_t seed = ::hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  ::hypermap::testing::Rng rng(seed);
  GeoPackageOptions trusting;
  trusting.max_checked_bytes = 0;
  for (int i = 0; i < 60; ++i) {
    std::string damaged = bytes;
    for (int flips = 0; flips < 20; ++flips) {
      damaged[::hypermap::testing::UniformInt(rng, 100, bytes.size() - 1)] =
          static_cast<char>(rng());
    }
    const testing::TemporaryFolder folder;
    WriteFile(folder / "site.gpkg", damaged);
    const auto store = OpenStore(folder.path(), trusting);
    auto map = store->Open("site");
    if (!map.ok()) continue;
    auto snapshot = (*map)->Load();
    if (!snapshot.ok()) {
      EXPECT_EQ(snapshot.status().code(), absl::StatusCode::kDataLoss);
    }
  }
}

// Damage by an SQL statement, and the error with which Open or Load then fails.
struct MapDamage {
  const char* sql;
  const char* message;
};

void PrintTo(const MapDamage& damage, std::ostream* out) { *out << damage.sql; }

class DamagedMapTest : public ::testing::TestWithParam<MapDamage> {};

TEST_P(DamagedMapTest, IsToldWithTableAndRow) {
  const testing::TemporaryFolder folder;
  {
    const auto store = OpenStore(folder.path());
    EditedMap map = CreateMap(*store, "site");
    LayerSpec polygons = SemanticSpec("s");
    polygons.shape_kinds = {ShapeKind::kPolygon};
    map.Edit({{CreateLayer{polygons}, PutObject{"s", UnitSquare("chair"), ""},
               CreateLayer{GridSpec("g", LayerKind::kOccupancy, {}, 0.05)},
               WriteCells{"g", {0, 1, 0, 1}, {0.5}},
               CreateLayer{GridSpec("f", LayerKind::kScalar, {}, 0.05)},
               WriteCells{"f", {0, 1, 0, 1}, {0.5}}, SetTransform{{"map", "robot", {}}}}});
  }
  {
    const auto other = Connect(folder / "site.gpkg");
    ASSERT_TRUE(other->Execute("PRAGMA foreign_keys = OFF").ok());
    const absl::Status status = other->Execute(GetParam().sql);
    ASSERT_TRUE(status.ok()) << status;
  }
  const auto store = OpenStore(folder.path());
  auto map = store->Open("site");
  const absl::Status status = map.ok() ? DamageFoundByLoad(**map) : map.status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("map site: "));
  EXPECT_THAT(std::string(status.message()), HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Table, DamagedMapTest,
    ::testing::Values(
        MapDamage{"UPDATE s SET geom = X'00'", "table s, id 1: geometry"},
        MapDamage{"UPDATE s SET geom = substr(geom, 1, length(geom) - 1)", "cut short"},
        MapDamage{"UPDATE s SET geom = 'text'", "column geom holds text"},
        MapDamage{
            "UPDATE s SET geom = X'47500001ffffffff0101000000000000000000f03f000000000000f03f'",
            "table s, id 1: the layer takes no shapes of the kind point"},
        MapDamage{"UPDATE s SET label = ''", "object.label"},
        MapDamage{"UPDATE s SET existence = 2", "object.existence"},
        MapDamage{"UPDATE s SET existence = 'likely'", "column existence holds text"},
        MapDamage{"UPDATE s SET classes = '{'", "column classes"},
        MapDamage{"UPDATE s SET classes = '{\"a\":\"b\"}'", "column classes"},
        MapDamage{"UPDATE s SET classes = '{\"a\":7}'", "object.classes[a]"},
        MapDamage{"UPDATE s SET tags = '[[[[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]]]]'", "column tags"},
        MapDamage{"UPDATE s SET attributes = '{\"a\":{}}'", "column attributes"},
        MapDamage{"UPDATE s SET attributes = '{\"a\":18446744073709551615}'", "column attributes"},
        MapDamage{"UPDATE s SET height_min = 1", "height_max"},
        MapDamage{"UPDATE s SET height_min = 1, height_max = 0", "object.height"},
        MapDamage{"UPDATE s SET id = -5", "table s, id -5"},
        MapDamage{"UPDATE g SET tile_data = zeroblob(100)", "table g, id 1: PNG"},
        MapDamage{"UPDATE g SET tile_data = substr(tile_data, 1, 60)", "table g, id 1: PNG"},
        MapDamage{"UPDATE g SET tile_data = (SELECT tile_data FROM f)", "table g, id 1: PNG"},
        MapDamage{"UPDATE f SET tile_data = zeroblob(100)", "table f, id 1: TIFF"},
        MapDamage{"UPDATE f SET tile_data = substr(tile_data, 1, 60)", "table f, id 1: TIFF"},
        MapDamage{"UPDATE f SET tile_data = (SELECT tile_data FROM g)", "table f, id 1: TIFF"},
        MapDamage{"UPDATE g SET zoom_level = 3", "tile matrix"},
        MapDamage{"UPDATE g SET tile_row = -1", "tile matrix"},
        MapDamage{"UPDATE g SET tile_column = 65536", "tile matrix"},
        MapDamage{"UPDATE g SET tile_column = tile_column + 1", "outside of the layer's extent"},
        MapDamage{"UPDATE gpkg_2d_gridded_tile_ancillary SET scale = 2", "scale"},
        MapDamage{"DELETE FROM gpkg_2d_gridded_tile_ancillary", "column scale holds NULL"},
        MapDamage{"UPDATE hypermap_layers SET kind = 'voxels'", "unknown kind voxels"},
        MapDamage{"UPDATE hypermap_layers SET table_name = 'gpkg_contents' WHERE name = 's'",
                  "gpkg_contents"},
        MapDamage{"UPDATE hypermap_layers SET table_name = 'none' WHERE name = 's'",
                  "no such table"},
        MapDamage{"UPDATE hypermap_layers SET kind = 'semantic'", "layer.grid"},
        MapDamage{"UPDATE hypermap_layers SET kind = 'exploration' WHERE name = 'g'",
                  "pixel value 5000"},
        MapDamage{"UPDATE hypermap_layers SET resolution_m = 0 WHERE name = 'g'", "layer.grid"},
        MapDamage{"UPDATE hypermap_layers SET origin_x = 9e999 WHERE name = 'g'", "layer.grid"},
        MapDamage{"UPDATE hypermap_layers SET row_end = 99999999999 WHERE name = 'g'", "extent"},
        MapDamage{"UPDATE hypermap_layers SET parameters = '[]' WHERE name = 'g'", "parameters"},
        MapDamage{"UPDATE hypermap_layers SET parameters = '{\"unit\":3}' WHERE name = 'f'",
                  "parameters"},
        MapDamage{"UPDATE hypermap_layers SET parameters = '{\"explored_rule\":\"seen\"}' "
                  "WHERE name = 'g'",
                  "explored_rule seen"},
        MapDamage{"UPDATE hypermap_layers SET parameters = '{\"shape_kinds\":[\"cube\"]}' "
                  "WHERE name = 's'",
                  "shape_kinds: cube"},
        MapDamage{"UPDATE hypermap_layers SET parameters = '{\"shape_kinds\":[]}' WHERE name = 's'",
                  "layer.shape_kinds"},
        MapDamage{"UPDATE hypermap_layers SET parameters = '{\"shape_kinds\":\"point\"}' "
                  "WHERE name = 's'",
                  "parameters"},
        MapDamage{"UPDATE hypermap_frames SET parent_frame_id = 'robot'", "frame robot"},
        MapDamage{"UPDATE hypermap_frames SET yaw = 9e999", "frame robot"},
        MapDamage{"UPDATE hypermap_metadata SET revision = -1", "hypermap_metadata"},
        MapDamage{"UPDATE hypermap_metadata SET next_object_id = 'x'", "hypermap_metadata"},
        MapDamage{"DELETE FROM hypermap_metadata", "hypermap_metadata"},
        MapDamage{"DROP TABLE s", "no such table"},
        MapDamage{"ALTER TABLE s RENAME COLUMN tags TO words", "tags"},
        MapDamage{"DROP TABLE hypermap_receipts", "hypermap_receipts"},
        MapDamage{"DROP TABLE gpkg_2d_gridded_tile_ancillary", "gpkg_2d_gridded_tile_ancillary"},
        MapDamage{"ALTER TABLE hypermap_frames RENAME COLUMN yaw TO angle", "hypermap_frames"}));

}  // namespace
}  // namespace hypermap::storage
