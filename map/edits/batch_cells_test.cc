#include "map/edits/batch_cells.h"

#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::HasSubstr;
using testing::MakeSnapshot;

// A grid of cells of one metre.
CreateLayer Floor(const std::string& name, const std::string& frame_id = "") {
  LayerSpec spec{.name = name, .kind = LayerKind::kOccupancy, .frame_id = frame_id};
  spec.grid = GridGeometry{PlanarTransform(), 1.0};
  return {spec};
}

// Fills `side` x `side` cells from (x, y) on.
FillPolygon FillSquare(const std::string& layer, double x, double y, double side,
                       const std::string& frame_id = "") {
  const Polygon area = Polygon::FromBox({{x, y}, {x + side, y + side}});
  return {layer, area, frame_id, CellRule::kCentre, 1.0};
}

WriteCells WriteSquare(const std::string& layer, int32_t row, int32_t col, int32_t side) {
  return {layer,
          {row, row + side, col, col + side},
          std::vector<std::optional<double>>(int64_t{side} * side, 0.5)};
}

std::string ErrorOf(const EditBatch& batch, int64_t max_cells) {
  Limits limits;
  limits.max_cells = max_cells;
  const absl::Status status = Apply(MakeSnapshot("m", {{Floor("floor")}}), batch, limits).status();
  EXPECT_TRUE(status.ok() || absl::IsResourceExhausted(status)) << status;
  return std::string(status.message());
}

TEST(BatchCellsTest, B1EditsOfABatchShareTheLimitOfCells) {
  const EditBatch batch{{WriteSquare("floor", 0, 0, 10), WriteSquare("floor", 500, 500, 10),
                         WriteSquare("floor", 0, 0, 10)}};
  EXPECT_EQ(ErrorOf(batch, 300), "");
  EXPECT_EQ(ErrorOf(batch, 299),
            "edits[2]: the batch sets 300 cells up to here, more than --max_cells = 299");
  // A filled polygon counts as the box of its cells, with a margin.
  const EditBatch fills{{FillSquare("floor", 0, 0, 10), FillSquare("floor", 1000, 0, 10)}};
  EXPECT_EQ(ErrorOf(fills, 500), "");
  EXPECT_THAT(ErrorOf(fills, 199), HasSubstr("edits[1]: "));
}

TEST(BatchCellsTest, B1ManyLargeFillsAreRefusedBeforeAnyIsApplied) {
  EditBatch batch;
  for (int i = 0; i < 2000; ++i) {
    batch.edits.push_back(FillSquare("floor", (i % 250) * 8400.0 - 2e6, (i / 250) * 8400.0, 8000));
  }
  const Snapshot map = MakeSnapshot("m", {{Floor("floor")}});
  const absl::Status refused = CheckCells(map, batch, Limits().max_cells);
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("edits[1]: the batch sets "));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("--max_cells"));
  EXPECT_EQ(Apply(map, batch).status(), refused);
}

TEST(BatchCellsTest, B1TilesOfABatchAreLimitedToo) {
  constexpr int64_t kCells = 1'000'000;
  EditBatch scattered;
  for (int i = 0; i <= MaxTiles(kCells); ++i) {
    scattered.edits.push_back(WriteSquare("floor", 0, i * kTileSide, 1));
  }
  EXPECT_THAT(ErrorOf(scattered, kCells), HasSubstr("--max_cells = 1000000"));
  EXPECT_THAT(ErrorOf(scattered, kCells), HasSubstr("tiles of 128 x 128"));
  scattered.edits.pop_back();
  EXPECT_EQ(ErrorOf(scattered, kCells), "");
  // A tile counts once, however often it is written.
  EditBatch same;
  for (int i = 0; i < 5000; ++i) same.edits.push_back(WriteSquare("floor", 3, i % 100, 1));
  EXPECT_EQ(ErrorOf(same, kCells), "");
  // A thin area has few cells but touches many tiles.
  const Polygon strip = Polygon::FromBox({{-4e6, 0.1}, {4e6, 0.2}});
  const EditBatch thin{{FillPolygon{"floor", strip, "", CellRule::kTouched, 1.0}}};
  EXPECT_THAT(ErrorOf(thin, Limits().max_cells), HasSubstr("tiles of 128 x 128"));
}

TEST(BatchCellsTest, B1LimitTakesAnAreaOfItsSizeWhereverItLies) {
  const Snapshot map = MakeSnapshot("m", {{Floor("floor")}});
  for (const double at : {0.0, 0.5, 77.0, -4095.3}) {
    // 67 million cells with the margin.
    const EditBatch batch{{FillSquare("floor", at, -at, 8188)}};
    EXPECT_TRUE(CheckCells(map, batch, Limits().max_cells).ok()) << at;
  }
}

TEST(BatchCellsTest, B1CountsInLayersAndFramesThatTheBatchMakes) {
  const Snapshot map = MakeSnapshot("m", {{Floor("floor")}});
  const auto refusal = [&](const EditBatch& batch) {
    return std::string(CheckCells(map, batch, 1000).message());
  };
  EXPECT_THAT(refusal({{Floor("new"), FillSquare("new", 0, 0, 50)}}), HasSubstr("edits[1]"));
  // An area in another frame has the same size there.
  EXPECT_THAT(
      refusal({{SetTransform{{"", "dock", {1000, 0, 1}}}, Floor("new", "dock"),
                FillSquare("new", 0, 0, 10, "map"), FillSquare("floor", 0, 0, 50, "dock")}}),
      HasSubstr("edits[3]"));
  // The area has no place in the layer's frame, or the layer is gone: Apply refuses the edit.
  for (const EditBatch& batch : {EditBatch{{FillSquare("floor", 0, 0, 50, "moon")}},
                                 EditBatch{{DeleteLayer{"floor"}, FillSquare("floor", 0, 0, 50)}},
                                 EditBatch{{FillSquare("floor", 1e8, 0, 50)}}}) {
    EXPECT_EQ(refusal(batch), "");
    const absl::Status status = Apply(map, batch).status();
    EXPECT_FALSE(status.ok());
    EXPECT_FALSE(absl::IsResourceExhausted(status)) << status;
  }
}

TEST(BatchCellsTest, EditsThatTheServerAddsAreLimitedOneByOne) {
  Limits limits;
  limits.max_cells = 300;
  const Snapshot map = MakeSnapshot("m", {{Floor("floor")}});
  const EditBatch batch{{FillSquare("floor", 0, 0, 10), FillSquare("floor", 20, 0, 10),
                         FillSquare("floor", 40, 0, 10)}};
  EXPECT_TRUE(absl::IsResourceExhausted(Apply(map, batch, limits).status()));
  EXPECT_TRUE(ApplyExtended(map, batch, limits).ok());
}

}  // namespace
}  // namespace hypermap
