#include "storage/geopackage/table_names.h"

#include "gtest/gtest.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

TEST(TableNamesTest, AreTheLayersNamesWhereTheyCanBe) {
  const testing::TemporaryFolder folder;
  const auto database = Connect(folder / "x");
  const struct {
    const char* layer;
    const char* table;
  } cases[] = {{"semantic", "semantic"},       {"Robot-1.seen", "Robot_1_seen"},
               {"7th", "layer_7th"},           {"gpkg_contents", "layer_gpkg_contents"},
               {"GPKG_x", "layer_GPKG_x"},     {"rtree_a_geom", "layer_rtree_a_geom"},
               {"sqlite_x", "layer_sqlite_x"}, {"hypermap_layers", "layer_hypermap_layers"},
               {"Select", "layer_Select"},     {"layer_styles", "layer_layer_styles"}};
  for (const auto& c : cases) {
    EXPECT_EQ(TableNames::Read(database.get())->Take(c.layer), c.table);
    EXPECT_TRUE(IsLayerTableName(c.table));
  }
}

TEST(TableNamesTest, AreNotTakenTwice) {
  const testing::TemporaryFolder folder;
  const auto database = Connect(folder / "x");
  ASSERT_TRUE(database->Execute("CREATE TABLE A_b (x); CREATE TABLE a_B_2 (x)").ok());
  absl::StatusOr<TableNames> names = TableNames::Read(database.get());
  ASSERT_TRUE(names.ok()) << names.status();
  EXPECT_EQ(names->Take("a-b"), "a_b_3");
  EXPECT_EQ(names->Take("A.B"), "A_B_4");
  names->GiveBack("A_b");
  EXPECT_EQ(names->Take("a-b"), "a_b");
}

TEST(TableNamesTest, OthersAreNotForLayers) {
  for (const char* name : {"", "a b", "a\"b", "1", "table", "Gpkg_x", "hypermap_layers", "ä"}) {
    EXPECT_FALSE(IsLayerTableName(name)) << name;
  }
}

}  // namespace
}  // namespace hypermap::storage
