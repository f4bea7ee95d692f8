#include "storage/interchange/occupancy_pixels.h"

#include <cmath>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "storage/interchange/testing/content.h"

namespace hypermap::storage {
namespace {

using testing::Grid;

constexpr int kUnknown = PixelMeaning::kUnknown;

int Percent(const MapServerYaml& yaml, GreyAlpha pixel) {
  return PixelMeaning(yaml).PercentOf(pixel);
}

TEST(PixelMeaningTest, TrinaryComparesStrictly) {
  const MapServerYaml yaml{.mode = OccupancyMode::kTrinary};
  EXPECT_EQ(Percent(yaml, {0, 255}), 100);
  EXPECT_EQ(Percent(yaml, {254, 255}), 0);
  EXPECT_EQ(Percent(yaml, {255, 255}), 0);
  // (255 - 205) / 255 = 0.19608 is not below 0.196.
  EXPECT_EQ(Percent(yaml, {205, 255}), kUnknown);
  EXPECT_EQ(Percent(yaml, {206, 255}), 0);
  EXPECT_EQ(Percent(yaml, {127, 255}), kUnknown);
  EXPECT_EQ(Percent(yaml, {0, 254}), kUnknown);
  // A pixel exactly at a threshold lies beyond neither: 51 / 255 = 0.2, 204 / 255 = 0.8.
  const MapServerYaml exact{.occupied_thresh = 0.8, .free_thresh = 0.2};
  EXPECT_EQ(Percent(exact, {255 - 51, 255}), kUnknown);
  EXPECT_EQ(Percent(exact, {255 - 50, 255}), 0);
  EXPECT_EQ(Percent(exact, {255 - 204, 255}), kUnknown);
  EXPECT_EQ(Percent(exact, {255 - 205, 255}), 100);
}

TEST(PixelMeaningTest, ScaleIsLinearBetweenTheThresholds) {
  const MapServerYaml yaml{
      .occupied_thresh = 0.8, .free_thresh = 0.2, .mode = OccupancyMode::kScale};
  EXPECT_EQ(Percent(yaml, {255 - 51, 255}), 0);
  EXPECT_EQ(Percent(yaml, {255 - 50, 255}), 0);
  EXPECT_EQ(Percent(yaml, {255 - 102, 255}), 33);  // (0.4 - 0.2) / 0.6
  EXPECT_EQ(Percent(yaml, {255 - 153, 255}), 67);  // (0.6 - 0.2) / 0.6
  EXPECT_EQ(Percent(yaml, {255 - 204, 255}), 100);
  EXPECT_EQ(Percent(yaml, {0, 255}), 100);
  EXPECT_EQ(Percent(yaml, {0, 0}), kUnknown);
}

TEST(PixelMeaningTest, NegateTurnsGreyRoundInEveryMode) {
  MapServerYaml yaml{.negate = true};
  EXPECT_EQ(Percent(yaml, {0, 255}), 0);
  EXPECT_EQ(Percent(yaml, {255, 255}), 100);
  EXPECT_EQ(Percent(yaml, {128, 255}), kUnknown);
  yaml = {.negate = true, .occupied_thresh = 1, .free_thresh = 0, .mode = OccupancyMode::kScale};
  EXPECT_EQ(Percent(yaml, {102, 255}), 40);
  EXPECT_EQ(Percent(yaml, {102, 128}), kUnknown);
  yaml.mode = OccupancyMode::kRaw;
  EXPECT_EQ(Percent(yaml, {255 - 40, 255}), 40);
  EXPECT_EQ(Percent(yaml, {40, 255}), kUnknown);
}

TEST(PixelMeaningTest, RawIsTheByteWhateverItsAlpha) {
  const MapServerYaml yaml{.mode = OccupancyMode::kRaw};
  for (const uint8_t alpha : {0, 127, 255}) {
    EXPECT_EQ(Percent(yaml, {0, alpha}), 0);
    EXPECT_EQ(Percent(yaml, {57, alpha}), 57);
    EXPECT_EQ(Percent(yaml, {100, alpha}), 100);
    EXPECT_EQ(Percent(yaml, {101, alpha}), kUnknown);
    EXPECT_EQ(Percent(yaml, {128, alpha}), kUnknown);  // negative as the original's signed byte
    EXPECT_EQ(Percent(yaml, {255, alpha}), kUnknown);
  }
}

TEST(PixelMeaningTest, OddThresholdsGiveAnAnswerForEveryPixel) {
  for (const auto& [occupied, free] :
       {std::pair(0.5, 0.5), std::pair(0.2, 0.8), std::pair(-1e300, 1e300),
        std::pair(1e300, -1e300), std::pair(1.0, 1.0)}) {
    for (const OccupancyMode mode : {OccupancyMode::kTrinary, OccupancyMode::kScale}) {
      const MapServerYaml yaml{.occupied_thresh = occupied, .free_thresh = free, .mode = mode};
      for (int grey = 0; grey < 256; ++grey) {
        const int percent = Percent(yaml, {static_cast<uint8_t>(grey), 255});
        EXPECT_TRUE(percent <= 100 || percent == kUnknown);
      }
    }
  }
}

TEST(ScaleImageTest, EveryHundredthComesBack) {
  GridPicture picture;
  picture.width = 102;
  picture.height = 1;
  for (int percent = 0; percent <= 100; ++percent) picture.percents.push_back(percent);
  picture.percents.push_back(kUnknown);
  const GreyAlphaImage image = ScaleImage(picture);
  EXPECT_EQ(image.pixels[0], (GreyAlpha{255, 255}));
  EXPECT_EQ(image.pixels[100], (GreyAlpha{0, 255}));
  EXPECT_EQ(image.pixels[101], (GreyAlpha{127, 0}));
  const PixelMeaning meaning(
      MapServerYaml{.occupied_thresh = 1.0, .free_thresh = 0.0, .mode = OccupancyMode::kScale});
  for (int i = 0; i < 102; ++i) EXPECT_EQ(meaning.PercentOf(image.pixels[i]), picture.percents[i]);
}

// The layer that AppendCells makes of an image.
Snapshot Draw(const GreyAlphaImage& image, const GridGeometry& geometry = GridGeometry()) {
  ImportedMap imported;
  imported.batch.edits.push_back(CreateLayer{LayerSpec{
      .name = "grid", .kind = LayerKind::kOccupancy, .frame_id = "map", .grid = geometry}});
  EXPECT_TRUE(AppendCells(image, PixelMeaning(MapServerYaml()), "grid", imported.batch.edits).ok());
  return testing::MapOf(imported);
}

constexpr GreyAlpha kFree{255, 255};
constexpr GreyAlpha kOccupied{0, 255};
constexpr GreyAlpha kTransparent{127, 0};

TEST(AppendCellsTest, TopRowOfTheImageIsTheHighestRow) {
  const Snapshot map = Draw({2, 2, {kFree, kOccupied, kTransparent, kFree}});
  const GridLayer& grid = Grid(map, "grid");
  EXPECT_EQ(grid.extent(), (CellBox{0, 2, 0, 2}));
  EXPECT_EQ(grid.ValueAt({1, 0}), 0.0);
  EXPECT_EQ(grid.ValueAt({1, 1}), 1.0);
  EXPECT_EQ(grid.ValueAt({0, 0}), std::nullopt);
  EXPECT_EQ(grid.ValueAt({0, 1}), 0.0);
}

TEST(AppendCellsTest, ExtentIsTheWholeImageThoughLittleOfItIsKnown) {
  GreyAlphaImage image{3000, 2000, std::vector<GreyAlpha>(3000 * 2000, kTransparent)};
  image.row(1500)[700] = kOccupied;
  std::vector<Edit> edits;
  ASSERT_TRUE(AppendCells(image, PixelMeaning(MapServerYaml()), "grid", edits).ok());
  size_t num_values = 0;
  for (const Edit& edit : edits) num_values += std::get<WriteCells>(edit).values.size();
  EXPECT_LE(num_values, 128u * 128u + 2u);
  const Snapshot map = Draw(image);
  EXPECT_EQ(Grid(map, "grid").extent(), (CellBox{0, 2000, 0, 3000}));
  EXPECT_EQ(Grid(map, "grid").ValueAt({2000 - 1 - 1500, 700}), 1.0);
  EXPECT_EQ(Grid(map, "grid").ValueAt({0, 0}), std::nullopt);
}

TEST(AppendCellsTest, AllUnknownStillHasAnExtent) {
  const Snapshot map = Draw({5, 7, std::vector<GreyAlpha>(35, kTransparent)});
  EXPECT_EQ(Grid(map, "grid").extent(), (CellBox{0, 7, 0, 5}));
}

TEST(TakePictureTest, OriginFollowsTheExtentAndTurnsWithTheGrid) {
  const GridGeometry turned{PlanarTransform(1.0, 2.0, std::acos(-1.0) / 2), 0.5};
  Snapshot map = Draw({1, 1, {kOccupied}}, turned);
  EditBatch batch;
  batch.edits.push_back(WriteCells{"grid", {-2, -1, -4, -3}, {0.25}});
  map = *Apply(map, batch)->snapshot;
  const absl::StatusOr<GridPicture> picture = TakePicture(Grid(map, "grid"), 100);
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_EQ(picture->width, 5);
  EXPECT_EQ(picture->height, 3);
  // 4 columns (2 m) back along the grid's x axis, the layer's y; 2 rows back along its -x.
  EXPECT_NEAR(picture->geometry.layer_from_grid.x(), 1.0 + 1.0, 1e-12);
  EXPECT_NEAR(picture->geometry.layer_from_grid.y(), 2.0 - 2.0, 1e-12);
  EXPECT_EQ(picture->geometry.layer_from_grid.yaw(), turned.layer_from_grid.yaw());
  EXPECT_EQ(picture->percents[2 * 5 + 0], 25);  // bottom left
  EXPECT_EQ(picture->percents[0 * 5 + 4], 100);
  EXPECT_EQ(picture->num_rounded, 0);
}

TEST(TakePictureTest, CountsWhatItRounds) {
  Snapshot map = Draw({1, 1, {kOccupied}});
  EditBatch batch;
  batch.edits.push_back(WriteCells{"grid", {0, 1, 0, 4}, {0.123, 0.12, 0.0001, std::nullopt}});
  map = *Apply(map, batch)->snapshot;
  const absl::StatusOr<GridPicture> picture = TakePicture(Grid(map, "grid"), 100);
  ASSERT_TRUE(picture.ok());
  EXPECT_EQ(picture->num_rounded, 2);
  EXPECT_THAT(picture->percents, ::testing::ElementsAre(12, 12, 0, kUnknown));
}

TEST(TakePictureTest, FarApartCellsDoNotMakeAHugeImage) {
  Snapshot map = Draw({1, 1, {kOccupied}});
  EditBatch batch;
  batch.edits.push_back(WriteCells{"grid", {4000000, 4000001, 4000000, 4000001}, {0.5}});
  map = *Apply(map, batch)->snapshot;
  const absl::Status status = TakePicture(Grid(map, "grid"), int64_t{1} << 28).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("--max_cells"));
}

}  // namespace
}  // namespace hypermap::storage
