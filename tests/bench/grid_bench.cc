// Finding the cells that a polygon covers, row by row along its edges, and their values, against a
// test of each cell.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "benchmark/benchmark.h"
#include "map/geometry/predicates.h"
#include "map/grid/cell_cover.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "tests/bench/compare.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

// Polygons of `radius_m` around the origin.
std::vector<Polygon> MakeAreas(double radius_m) {
  testing::Rng rng(1);
  std::vector<Polygon> areas;
  for (int i = 0; i < 16; ++i) areas.push_back(testing::RandomPolygon(rng, {0, 0}, radius_m));
  return areas;
}

int64_t CountBySpans(const Polygon& area, const GridGeometry& geometry) {
  const CellCover cover(area, geometry, kAllCells);
  int64_t count = 0;
  for (int32_t row = cover.bounds().row_begin; row < cover.bounds().row_end; ++row) {
    for (const ColumnSpan& span : cover.SpansOfRow(row)) count += span.col_end - span.col_begin;
  }
  return count;
}

int64_t CountCellByCell(const Polygon& area, const GridGeometry& geometry) {
  const CellBox box = CellCover(area, geometry, kAllCells).bounds();
  int64_t count = 0;
  for (CellIndex cell{box.row_begin, 0}; cell.row < box.row_end; ++cell.row) {
    for (cell.col = box.col_begin; cell.col < box.col_end; ++cell.col) {
      if (Covers(area, geometry.CentreOf(cell))) ++count;
    }
  }
  return count;
}

// Cells of 5 cm in an area of a few metres.
void CellsInArea(benchmark::State& state, double yaw, bool run_brute_force) {
  const GridGeometry geometry{PlanarTransform(0.3, -0.7, yaw), 0.05};
  Compare(
      state, MakeAreas(static_cast<double>(state.range(0))), run_brute_force,
      [&](const Polygon& area) { return CountBySpans(area, geometry); },
      [&](const Polygon& area) { return CountCellByCell(area, geometry); });
}

constexpr double kResolution = 0.05;
constexpr int32_t kGridSide = 5'000;

// Patches of free space and clutter. Larger than the processor's caches.
const GridLayer& LargeGrid() {
  static const std::shared_ptr<const GridLayer> grid = [] {
    testing::Rng rng(2);
    const double shades[] = {0.02, 0.02, 0.02, 0.02, 0.04, 0.86};
    LayerSpec spec{.name = "grid", .kind = LayerKind::kOccupancy, .frame_id = "map"};
    spec.grid = GridGeometry{{}, kResolution};
    GridWriter writer(std::static_pointer_cast<const GridLayer>(MakeEmptyLayer(std::move(spec))));
    std::vector<std::optional<double>> strip(kTileSide * kGridSide);
    for (int32_t row = 0; row < kGridSide; row += kTileSide) {
      for (size_t i = 0; i < strip.size(); i += 8) {
        const std::optional<double> value = shades[testing::UniformInt(rng, 0, 5)];
        std::fill_n(strip.begin() + i, 8, value);
      }
      if (!writer.Write({row, row + kTileSide, 0, kGridSide}, strip).ok()) std::abort();
    }
    return std::move(writer).Finish().layer;
  }();
  return *grid;
}

std::vector<Polygon> SquaresOf(double side_m) {
  testing::Rng rng(3);
  std::vector<Polygon> squares;
  for (int i = 0; i < 4096; ++i) {
    const double end_m = kGridSide * kResolution - side_m;
    const Point low{testing::Uniform(rng, 0, end_m), testing::Uniform(rng, 0, end_m)};
    squares.push_back(Polygon::FromBox({low, {low.x + side_m, low.y + side_m}}));
  }
  return squares;
}

// Mixes a cell and its value into a checksum, so that answers can be compared.
uint64_t Mixed(uint64_t sum, const CellIndex& cell, double value) {
  return sum + static_cast<uint64_t>(value * 1e4) * (cell.row * 31 + cell.col);
}

uint64_t ReadArea(const GridLayer& grid, const Polygon& area) {
  uint64_t sum = 0;
  for (const auto cursor = grid.ContentIn(area); !cursor->done();) {
    for (const CellRun& run : cursor->Next(4096).runs) {
      for (int32_t col = run.col_begin; col < run.col_end; ++col) {
        sum = Mixed(sum, {run.row, col}, run.value.value_or(-1));
      }
    }
  }
  return sum;
}

uint64_t ReadAreaCellByCell(const GridLayer& grid, const Polygon& area) {
  const CellBox box = CellCover(area, grid.geometry(), grid.extent()).bounds();
  uint64_t sum = 0;
  for (CellIndex cell{box.row_begin, 0}; cell.row < box.row_end; ++cell.row) {
    for (cell.col = box.col_begin; cell.col < box.col_end; ++cell.col) {
      if (!Covers(area, grid.geometry().CentreOf(cell))) continue;
      sum = Mixed(sum, cell, grid.ValueAt(cell).value_or(-1));
    }
  }
  return sum;
}

void GridArea(benchmark::State& state, bool run_brute_force) {
  const GridLayer& grid = LargeGrid();
  Compare(
      state, SquaresOf(static_cast<double>(state.range(0))), run_brute_force,
      [&](const Polygon& area) { return ReadArea(grid, area); },
      [&](const Polygon& area) { return ReadAreaCellByCell(grid, area); });
}

BENCHMARK_CAPTURE(GridArea, fast, false)->Name("grid_area")->Arg(2);
BENCHMARK_CAPTURE(GridArea, slow, true)->Name("grid_area/brute_force")->Arg(2);

BENCHMARK_CAPTURE(CellsInArea, fast, 0.0, false)->Name("cells_in_area")->Arg(2)->Arg(20);
BENCHMARK_CAPTURE(CellsInArea, slow, 0.0, true)->Name("cells_in_area/brute_force")->Arg(2)->Arg(20);
BENCHMARK_CAPTURE(CellsInArea, fast_turned, 0.4, false)
    ->Name("cells_of_turned_grid_in_area")
    ->Arg(2)
    ->Arg(20);
BENCHMARK_CAPTURE(CellsInArea, slow_turned, 0.4, true)
    ->Name("cells_of_turned_grid_in_area/brute_force")
    ->Arg(2)
    ->Arg(20);

}  // namespace
}  // namespace hypermap
