// Which cells a polygon covers, row by row along its edges, against a look at each cell.
#include <cstdint>
#include <vector>

#include "benchmark/benchmark.h"
#include "map/geometry/predicates.h"
#include "map/layers/grid/cell_cover.h"
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

// Cells of 5 cm in an area of some metres.
void CellsInArea(benchmark::State& state, double yaw, bool run_brute_force) {
  const GridGeometry geometry{PlanarTransform(0.3, -0.7, yaw), 0.05};
  Compare(
      state, MakeAreas(static_cast<double>(state.range(0))), run_brute_force,
      [&](const Polygon& area) { return CountBySpans(area, geometry); },
      [&](const Polygon& area) { return CountCellByCell(area, geometry); });
}

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
