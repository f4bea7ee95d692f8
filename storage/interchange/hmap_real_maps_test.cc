#include <algorithm>

#include "base/limits/limits.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/interchange/hmap.h"
#include "storage/interchange/nav2.h"
#include "storage/interchange/testing/content.h"

namespace hypermap::storage {
namespace {

using ::testing::Contains;
using testing::DataFolder;
using testing::ExpectSameContent;
using testing::Grid;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MapOf;
using testing::Objects;
using testing::ReadFile;

class RealMapsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (DataFolder().empty()) GTEST_SKIP() << "no HYPERMAP_DATA";
  }

  static ImportedMap Decode(const std::string& name) {
    const std::string data = ReadFile(DataFolder() / "maps" / name);
    absl::StatusOr<ImportedMap> imported = DecodeHmap(data, Limits());
    EXPECT_TRUE(imported.ok()) << name << ": " << imported.status();
    return imported.ok() ? *std::move(imported) : ImportedMap();
  }
};

int64_t CountLabel(const std::vector<SemanticObject>& objects, const std::string& label) {
  return std::count_if(objects.begin(), objects.end(),
                       [&](const SemanticObject& object) { return object.label == label; });
}

TEST_F(RealMapsTest, EveryMapComesBackFromItsExportWithEqualContent) {
  int num_maps = 0;
  for (const auto& entry : std::filesystem::directory_iterator(DataFolder() / "maps")) {
    if (entry.path().extension() != ".hmap") continue;
    SCOPED_TRACE(entry.path().filename());
    ++num_maps;
    const Snapshot map = MapOf(Decode(entry.path().filename()));
    const absl::StatusOr<ExportedFiles> exported = EncodeHmap(map);
    ASSERT_TRUE(exported.ok()) << exported.status();
    EXPECT_THAT(exported->omissions, IsEmpty());
    ASSERT_EQ(exported->files.size(), 1u);
    EXPECT_EQ(exported->files[0].name, "site.hmap");
    const absl::StatusOr<ImportedMap> again = DecodeHmap(exported->files[0].data, Limits());
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_THAT(again->repairs, IsEmpty());
    ExpectSameContent(map, MapOf(*again));
  }
  EXPECT_GE(num_maps, 6);
}

TEST_F(RealMapsTest, OfficeHas35ObjectsAndOneMissingComma) {
  const ImportedMap imported = Decode("map_office_small_sem_gt.hmap");
  EXPECT_THAT(imported.repairs,
              Contains("semantic object 23 (tvmonitor): missing comma after vertex 3"));
  EXPECT_EQ(std::count_if(imported.repairs.begin(), imported.repairs.end(),
                          [](const std::string& line) {
                            return line.find("ring left open") == std::string::npos;
                          }),
            1);
  const Snapshot map = MapOf(imported);
  const std::vector<SemanticObject> objects = Objects(map, "semantic");
  ASSERT_EQ(objects.size(), 35u);
  EXPECT_EQ(CountLabel(objects, "chair"), 7);
  EXPECT_EQ(objects[22].shape.polygon().outer().size(), 4u);
  const PointContent content = map.FindLayer("semantic")->ContentAt({2.75, 0.4});
  ASSERT_EQ(content.objects.size(), 2u);
  EXPECT_EQ(content.objects[0]->label, "diningtable");
  EXPECT_EQ(content.objects[1]->label, "cup");
}

TEST_F(RealMapsTest, OfficeGridLiesWhereItsYamlSays) {
  const Snapshot map = MapOf(Decode("map_office_small_sem_gt.hmap"));
  const GridLayer& grid = Grid(map, "occupancy");
  EXPECT_EQ(grid.geometry().resolution_m, 0.05);
  EXPECT_EQ(grid.geometry().layer_from_grid, PlanarTransform(-15.4, -12.2, 0.0));
  EXPECT_EQ(grid.extent().row_begin, 0);
  EXPECT_EQ(grid.extent().col_begin, 0);
  EXPECT_EQ(grid.ContentAt({2.75, 0.4}).status, AnswerStatus::kValue);
}

TEST_F(RealMapsTest, TheSameOfficeAsPgmAgrees) {
  const std::filesystem::path folder = DataFolder() / "rgbd" / "office_small";
  const absl::StatusOr<ImportedMap> imported =
      DecodeNav2({{"occupancy.yaml", ReadFile(folder / "occupancy.yaml")},
                  {"occupancy.pgm", ReadFile(folder / "occupancy.pgm")}},
                 "occupancy", "map", Limits());
  ASSERT_TRUE(imported.ok()) << imported.status();
  const Snapshot pgm = MapOf(*imported);
  const Snapshot hmap = MapOf(Decode("map_office_small_sem_gt.hmap"));
  const GridLayer& a = Grid(pgm, "occupancy");
  const GridLayer& b = Grid(hmap, "occupancy");
  ASSERT_EQ(a.extent(), b.extent());
  ASSERT_EQ(a.geometry(), b.geometry());
  // The PGM is trinary: it says what the image of the .hmap says beyond map_server's thresholds.
  for (int32_t row = 0; row < a.extent().row_end; ++row) {
    for (int32_t col = 0; col < a.extent().col_end; ++col) {
      const std::optional<double> fine = b.ValueAt({row, col});
      std::optional<double> coarse;
      if (fine && *fine > 0.65) coarse = 1.0;
      if (fine && *fine < 0.196) coarse = 0.0;
      ASSERT_EQ(a.ValueAt({row, col}), coarse) << row << ", " << col;
    }
  }
}

TEST_F(RealMapsTest, FloorRepeatsAndWindsRound) {
  const ImportedMap imported = Decode("map_floor_t1.hmap");
  EXPECT_THAT(imported.repairs, Contains(HasSubstr("repeat")));
  const Snapshot map = MapOf(imported);
  for (const SemanticObject& object : Objects(map, "semantic")) {
    EXPECT_TRUE(Polygon::Make(object.shape.polygon().outer()).ok()) << object.label;
  }
}

TEST_F(RealMapsTest, ExampleHasTagsAsClasses) {
  const std::vector<SemanticObject> objects =
      Objects(MapOf(Decode("hmap_example.hmap")), "semantic");
  ASSERT_EQ(objects.size(), 2u);
  EXPECT_EQ(objects[0].label, "chair");
  EXPECT_EQ(objects[0].tags, (std::vector<std::string>{"furniture", "chair", "table"}));
  EXPECT_EQ(objects[0].classes, (ClassScores{{"furniture", 0.8}, {"chair", 0.6}, {"table", 0.3}}));
  EXPECT_EQ(objects[0].existence, 1.0);
}

}  // namespace
}  // namespace hypermap::storage
