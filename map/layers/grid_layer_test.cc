#include "map/layers/grid_layer.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/geometry/predicates.h"
#include "map/layers/layer_registry.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::Pointwise;
using testing::RandomCells;
using testing::RandomPolygon;
using testing::RandomTransform;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

std::shared_ptr<const GridLayer> EmptyGrid(LayerKind kind, GridGeometry geometry) {
  return std::static_pointer_cast<const GridLayer>(
      MakeEmptyLayer({.name = "grid", .kind = kind, .frame_id = "map", .grid = geometry}));
}

std::vector<CellRun> ReadAll(AnswerCursor& cursor, int max_items) {
  std::vector<CellRun> runs;
  while (!cursor.done()) {
    const AnswerPart part = cursor.Next(max_items);
    EXPECT_LE(part.runs.size(), static_cast<size_t>(max_items));
    runs.insert(runs.end(), part.runs.begin(), part.runs.end());
  }
  return runs;
}

using Cells = std::map<CellIndex, std::optional<double>>;

Cells Expand(const std::vector<CellRun>& runs) {
  Cells cells;
  for (const CellRun& run : runs) {
    for (int32_t col = run.col_begin; col < run.col_end; ++col) {
      EXPECT_TRUE(cells.emplace(CellIndex{run.row, col}, run.value).second) << "cell told twice";
    }
  }
  return cells;
}

// A grid and its oracle, a map of its cells.
struct Modelled {
  std::shared_ptr<const GridLayer> grid;
  Cells cells;  // Every cell of the extent.
};

Modelled RandomGrid(Rng& rng, LayerKind kind) {
  const bool turned = UniformInt(rng, 0, 1);
  GridGeometry geometry{turned ? RandomTransform(rng, 5) : PlanarTransform(-15.4, -12.2, 0), 0.05};
  GridWriter writer(EmptyGrid(kind, geometry));
  Cells written;
  CellBox extent;
  for (int i = 0; i < 4; ++i) {
    const int32_t row = UniformInt(rng, -200, 100);
    const int32_t col = UniformInt(rng, -200, 100);
    const CellBox box{row, row + UniformInt(rng, 1, 80), col, col + UniformInt(rng, 1, 80)};
    const auto values = RandomCells(rng, kind, box);
    EXPECT_TRUE(writer.Write(box, values).ok());
    size_t next = 0;
    for (int32_t r = box.row_begin; r < box.row_end; ++r) {
      for (int32_t c = box.col_begin; c < box.col_end; ++c) written[{r, c}] = values[next++];
    }
    extent = extent.Union(box);
  }
  Modelled model{std::move(writer).Finish().layer, {}};
  for (int32_t r = extent.row_begin; r < extent.row_end; ++r) {
    for (int32_t c = extent.col_begin; c < extent.col_end; ++c) model.cells[{r, c}];
  }
  for (const auto& [cell, value] : written) model.cells[cell] = value;
  return model;
}

class GridLayerRandomTest : public ::testing::TestWithParam<LayerKind> {
 protected:
  const uint64_t seed_ = TestSeed();
  Rng rng_{seed_};
  ::testing::ScopedTrace trace_{__FILE__, __LINE__, "HYPERMAP_TEST_SEED=" + std::to_string(seed_)};
};

TEST_P(GridLayerRandomTest, ContentInAreaIsEveryCellWhoseCentreIsCovered) {
  for (int i = 0; i < 10; ++i) {
    const Modelled model = RandomGrid(rng_, GetParam());
    const Box bounds = model.grid->Bounds();
    const Point centre{Uniform(rng_, bounds.min.x, bounds.max.x),
                       Uniform(rng_, bounds.min.y, bounds.max.y)};
    const Polygon area = RandomPolygon(rng_, centre, 4, i % 2 ? 0.025 : 0);
    Cells expected;
    for (const auto& [cell, value] : model.cells) {
      if (Covers(area, model.grid->geometry().CentreOf(cell))) expected[cell] = value;
    }
    EXPECT_EQ(Expand(ReadAll(*model.grid->ContentIn(area), UniformInt(rng_, 1, 100))), expected);
  }
}

// The grid has patches, so that many rows equal the row before.
TEST_P(GridLayerRandomTest, ContentInBoxesOfPatchesIsEveryCellWhoseCentreIsCovered) {
  const GridGeometry geometry{PlanarTransform(-15.4, -12.2, 0), 0.05};
  const CellBox box{-60, 200, -70, 190};
  const auto shades = RandomCells(rng_, GetParam(), {0, 1, 0, 4});
  std::vector<std::optional<double>> values;
  for (int32_t row = box.row_begin; row < box.row_end; ++row) {
    for (int32_t col = box.col_begin; col < box.col_end; ++col) {
      values.push_back(shades[((row + 70) / 9 * 5 + (col + 70) / 11 * 3) % shades.size()]);
    }
  }
  GridWriter writer(EmptyGrid(GetParam(), geometry));
  ASSERT_TRUE(writer.Write(box, values).ok());
  const auto grid = std::move(writer).Finish().layer;
  for (int i = 0; i < 40; ++i) {
    const CellIndex cell{UniformInt(rng_, -70, 190), UniformInt(rng_, -80, 180)};
    const Point low = geometry.CentreOf(cell);
    const double side = i % 2 ? Uniform(rng_, 0.1, 8) : 0.05 * UniformInt(rng_, 1, 160);
    const Polygon area = Polygon::FromBox({low, {low.x + side, low.y + side}});
    Cells expected;
    for (size_t c = 0; c < values.size(); ++c) {
      const auto cols = static_cast<size_t>(box.cols());
      const CellIndex at{box.row_begin + static_cast<int32_t>(c / cols),
                         box.col_begin + static_cast<int32_t>(c % cols)};
      if (Covers(area, geometry.CentreOf(at))) expected[at] = values[c];
    }
    const auto runs = ReadAll(*grid->ContentIn(area), UniformInt(rng_, 1, 100));
    EXPECT_EQ(Expand(runs), expected);
    // Runs must be as long as possible.
    for (size_t r = 1; r < runs.size(); ++r) {
      EXPECT_FALSE(runs[r - 1].row == runs[r].row && runs[r - 1].col_end == runs[r].col_begin &&
                   runs[r - 1].value == runs[r].value);
    }
  }
}

TEST_P(GridLayerRandomTest, FindIsEveryMatchingCell) {
  const std::pair<ValueQuery, std::function<bool(std::optional<double>)>> queries[] = {
      {ValueKeyword::kUnknown, [](auto v) { return !v; }},
      {ValueKeyword::kFree, [](auto v) { return v && *v < 0.196; }},
      {ValueKeyword::kOccupied, [](auto v) { return v && *v > 0.65; }},
      {ValueKeyword::kExplored, [](auto v) { return v && *v == 1; }},
      {ValueKeyword::kUnexplored, [](auto v) { return v && *v == 0; }},
      {ValueRange{.low = 0.65, .low_open = true}, [](auto v) { return v && *v > 0.65; }},
      {ValueRange{.low = -70, .high = 0.2}, [](auto v) { return v && *v >= -70 && *v <= 0.2; }},
  };
  const Modelled model = RandomGrid(rng_, GetParam());
  for (const auto& [query, matches] : queries) {
    auto cursor = model.grid->Find(query, nullptr);
    if (!cursor) continue;
    Cells expected;
    for (const auto& [cell, value] : model.cells) {
      if (matches(value)) expected[cell] = value;
    }
    EXPECT_EQ(Expand(ReadAll(*cursor, 1000)), expected);
  }
}

TEST_P(GridLayerRandomTest, ContentAtIsTheCellThatHoldsThePoint) {
  const Modelled model = RandomGrid(rng_, GetParam());
  const PlanarTransform grid_from_layer = model.grid->geometry().layer_from_grid.Inverse();
  for (int i = 0; i < 500; ++i) {
    const Point p{Uniform(rng_, -25, 25), Uniform(rng_, -25, 25)};
    const Point q = grid_from_layer * p;
    const CellIndex cell{static_cast<int32_t>(std::floor(q.y / 0.05)),
                         static_cast<int32_t>(std::floor(q.x / 0.05))};
    const PointContent content = model.grid->ContentAt(p);
    const auto expected = model.cells.find(cell);
    if (expected == model.cells.end()) {
      EXPECT_EQ(content.status, AnswerStatus::kOutside);
    } else {
      EXPECT_EQ(content.value, expected->second);
      EXPECT_EQ(content.status, expected->second ? AnswerStatus::kValue : AnswerStatus::kUnknown);
    }
  }
}

TEST_P(GridLayerRandomTest, NearestAreTheNearestMatchingCentres) {
  for (const bool unknown : {true, false}) {
    const Modelled model = RandomGrid(rng_, GetParam());
    const ValueQuery query = unknown ? ValueQuery(ValueKeyword::kUnknown)
                             : GetParam() == LayerKind::kExploration
                                 ? ValueQuery(ValueKeyword::kExplored)
                                 : ValueQuery(ValueRange{.low = -50});
    const CodePredicate matches = *model.grid->domain().Match(query);
    const Point p{Uniform(rng_, -25, 25), Uniform(rng_, -25, 25)};
    std::vector<double> expected;
    for (const auto& [cell, value] : model.cells) {
      if (!matches(model.grid->CodeAt(cell))) continue;
      const Point centre = model.grid->geometry().CentreOf(cell);
      expected.push_back(std::hypot(centre.x - p.x, centre.y - p.y));
    }
    std::sort(expected.begin(), expected.end());
    expected.resize(std::min<size_t>(expected.size(), 20));
    std::vector<double> actual;
    const auto neighbours = model.grid->Nearest(p, query, 20);
    ASSERT_TRUE(neighbours.has_value());
    for (const Neighbour& n : *neighbours) actual.push_back(n.distance_m);
    // If the distances of two cells differ by a rounding only, either may be the last.
    EXPECT_THAT(actual, Pointwise(DoubleEq(), expected));
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, GridLayerRandomTest,
                         ::testing::Values(LayerKind::kOccupancy, LayerKind::kExploration,
                                           LayerKind::kScalar),
                         [](const auto& kind) { return std::string(LayerKindName(kind.param)); });

TEST(GridLayerTest, EmptyGridIsOutsideEverywhereAndHasNoCells) {
  const auto grid = EmptyGrid(LayerKind::kOccupancy, {PlanarTransform(), 0.1});
  EXPECT_EQ(grid->ContentAt({0, 0}).status, AnswerStatus::kOutside);
  EXPECT_TRUE(ReadAll(*grid->Find(ValueKeyword::kUnknown, nullptr), 10).empty());
  EXPECT_TRUE(grid->Nearest({0, 0}, ValueKeyword::kUnknown, 3)->empty());
  EXPECT_TRUE(grid->Bounds().empty());
}

TEST(GridLayerTest, CellsAreHalfOpenAndNegativeIndicesWork) {
  GridWriter writer(EmptyGrid(LayerKind::kOccupancy, {PlanarTransform(), 0.5}));
  ASSERT_TRUE(writer.Write({-1, 1, -1, 1}, {0.1, 0.2, 0.3, 0.4}).ok());
  const auto grid = std::move(writer).Finish().layer;
  EXPECT_EQ(grid->ContentAt({-0.5, -0.5}).value, 0.1);
  EXPECT_EQ(grid->ContentAt({0, -0.001}).value, 0.2);
  EXPECT_EQ(grid->ContentAt({-0.001, 0}).value, 0.3);
  EXPECT_EQ(grid->ContentAt({0, 0}).value, 0.4);
  EXPECT_EQ(grid->ContentAt({0.5, 0}).status, AnswerStatus::kOutside);
  EXPECT_EQ(grid->ContentAt({0, 0.5}).status, AnswerStatus::kOutside);
}

TEST(GridLayerTest, OccupancyKeepsFourDecimalsExactly) {
  GridWriter writer(EmptyGrid(LayerKind::kOccupancy, {PlanarTransform(), 1}));
  std::vector<std::optional<double>> values;
  for (int i = 0; i <= 10000; ++i) values.push_back(i / 10000.0);
  ASSERT_TRUE(writer.Write({0, 1, 0, 10001}, values).ok());
  const auto grid = std::move(writer).Finish().layer;
  for (int i = 0; i <= 10000; ++i) ASSERT_EQ(grid->ValueAt({0, i}), i / 10000.0);
}

TEST(GridWriterTest, RefusedWriteChangesNothing) {
  GridWriter writer(EmptyGrid(LayerKind::kOccupancy, {PlanarTransform(), 0.5}));
  EXPECT_EQ(writer.Write({0, 1, 0, 2}, {0.5, 1.5}).message(),
            "values[1]: value 1.5 is no probability in [0, 1]");
  EXPECT_EQ(writer.Write({0, 1, 0, 2}, {0.5}).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(writer.Write({0, 0, 0, 2}, {}).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(writer.Write({0, 1, kMaxCellIndex, kMaxCellIndex + 1}, {0.5}).code(),
            absl::StatusCode::kInvalidArgument);
  const auto result = std::move(writer).Finish();
  EXPECT_TRUE(result.written.empty());
  EXPECT_TRUE(result.layer->extent().empty());
}

TEST(GridWriterTest, TilesWithTheSameContentAreNotWrittenAgain) {
  GridWriter first(EmptyGrid(LayerKind::kExploration, {PlanarTransform(), 0.5}));
  ASSERT_TRUE(first.Write({0, 1, 0, 300}, std::vector<std::optional<double>>(300, 1.0)).ok());
  auto before = std::move(first).Finish();
  EXPECT_EQ(before.written.size(), 3u);
  GridWriter second(before.layer);
  ASSERT_TRUE(second.Write({0, 1, 0, 2}, {1.0, 1.0}).ok());
  ASSERT_TRUE(second.Write({0, 1, 299, 300}, {0.0}).ok());
  const auto after = std::move(second).Finish();
  ASSERT_EQ(after.written.size(), 1u);
  EXPECT_EQ(after.written.begin()->first, (TileIndex{0, 2}));
  EXPECT_EQ(after.written.begin()->second.before, before.layer->tiles().at({0, 2}));
  EXPECT_EQ(after.layer->tiles().at({0, 0}), before.layer->tiles().at({0, 0}));
  EXPECT_EQ(before.layer->ValueAt({0, 299}), 1.0);
}

TEST(GridWriterTest, UnknownCellsWhereThereIsNoTileAreNotWritten) {
  GridWriter writer(EmptyGrid(LayerKind::kExploration, {PlanarTransform(), 0.5}));
  ASSERT_TRUE(writer.Write({0, 1, 0, 2}, {std::nullopt, std::nullopt}).ok());
  const auto result = std::move(writer).Finish();
  EXPECT_TRUE(result.written.empty());
  EXPECT_TRUE(result.layer->tiles().empty());
  EXPECT_EQ(result.layer->extent(), (CellBox{0, 1, 0, 2}));
}

TEST(GridWriterTest, FillSetsTheCellsOfItsRule) {
  const auto area = Polygon::Make({{0.4, 0.4}, {2.6, 0.4}, {2.6, 1.6}, {0.4, 1.6}});
  ASSERT_TRUE(area.ok());
  for (const auto& [rule, count] :
       {std::pair{CellRule::kCentre, 3 * 2}, std::pair{CellRule::kCovered, 1 * 0},
        std::pair{CellRule::kTouched, 3 * 2}}) {
    GridWriter writer(EmptyGrid(LayerKind::kExploration, {PlanarTransform(), 1}));
    ASSERT_TRUE(writer.Fill(*area, rule, 1.0, 100).ok());
    const auto grid = std::move(writer).Finish().layer;
    int64_t cells = 0;
    for (const CellRun& run : ReadAll(*grid->Find(ValueKeyword::kExplored, nullptr), 10)) {
      cells += run.col_end - run.col_begin;
    }
    EXPECT_EQ(cells, count);
  }
}

TEST(GridWriterTest, FillPastItsLimitIsRefused) {
  GridWriter writer(EmptyGrid(LayerKind::kExploration, {PlanarTransform(), 0.01}));
  const auto status =
      writer.Fill(Polygon::FromBox({{0, 0}, {10, 10}}), CellRule::kCentre, 1.0, 999);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("max_cells"));
  EXPECT_TRUE(std::move(writer).Finish().written.empty());
}

TEST(CellDomainTest, KindsTakeTheirValuesAndRefuseOthers) {
  const auto takes = [](LayerKind kind, const ValueQuery& query) {
    return EmptyGrid(kind, {PlanarTransform(), 1})->Find(query, nullptr) != nullptr;
  };
  const ValueQuery label = ValueLabel{"chair"};
  for (const LayerKind kind :
       {LayerKind::kOccupancy, LayerKind::kExploration, LayerKind::kScalar}) {
    EXPECT_FALSE(takes(kind, label));
    EXPECT_FALSE(takes(kind, ValueTag{"furniture"}));
    EXPECT_TRUE(takes(kind, ValueKeyword::kUnknown));
    EXPECT_EQ(takes(kind, ValueKeyword::kFree), kind == LayerKind::kOccupancy);
    EXPECT_EQ(takes(kind, ValueKeyword::kOccupied), kind == LayerKind::kOccupancy);
    EXPECT_EQ(takes(kind, ValueKeyword::kExplored), kind == LayerKind::kExploration);
    EXPECT_EQ(takes(kind, ValueKeyword::kUnexplored), kind == LayerKind::kExploration);
    EXPECT_EQ(takes(kind, ValueRange{.low = 0.5}), kind != LayerKind::kExploration);
  }
}

TEST(CellDomainTest, ScalarIsFoundByTheNumberThatWasWritten) {
  GridWriter writer(EmptyGrid(LayerKind::kScalar, {PlanarTransform(), 1}));
  ASSERT_TRUE(writer.Write({0, 1, 0, 2}, {-60.1, 20.0}).ok());
  const auto grid = std::move(writer).Finish().layer;
  const auto runs = ReadAll(*grid->Find(ValueRange{.low = -60.1, .high = -60.1}, nullptr), 10);
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs[0].col_begin, 0);
}

}  // namespace
}  // namespace hypermap
