// The rows of a map's history, and its readers beside other programs.
#include <memory>
#include <string>

#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/conformance/testing/recorded_history.h"
#include "storage/conformance/testing/recorded_map.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;

class HistoryTest : public ::testing::Test {
 protected:
  void SetUp() override { store_ = OpenStore(folder_.path()); }
  RecordedMap NewMap() { return RecordedMap(CreateMap(*store_, "site")); }

  testing::TemporaryFolder folder_;
  std::unique_ptr<MapStore> store_;
};

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

}  // namespace
}  // namespace hypermap::storage
