// Updating the frontiers after an observation, which costs what it changed, against computing all
// of them anew.
#include <cstdint>
#include <numeric>
#include <vector>

#include "benchmark/benchmark.h"
#include "map/exploration/frontiers.h"
#include "tests/bench/compare.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

constexpr int32_t kSide = 4000;
constexpr int32_t kRange = 80;  // 4 m in cells of 5 cm

void Cover(const CellIndex& centre, int32_t radius, Coverage coverage, CoverageRaster* raster,
           std::vector<CellIndex>* changed) {
  for (int32_t row = centre.row - radius; row <= centre.row + radius; ++row) {
    for (int32_t col = centre.col - radius; col <= centre.col + radius; ++col) {
      const CellIndex cell{row, col};
      const int32_t r = row - centre.row, c = col - centre.col;
      if (r * r + c * c > radius * radius || raster->at(cell) == Coverage::kNone) continue;
      if (raster->at(cell) == coverage) continue;
      raster->set(cell, coverage);
      changed->push_back(cell);
    }
  }
}

// 200 m x 200 m with rooms of 10 m, seen from places all over the area.
CoverageRaster HalfSeen(testing::Rng& rng) {
  CoverageRaster raster(CellBox{0, kSide, 0, kSide}, Coverage::kNone);
  for (size_t i = 0; i < raster.values().size(); ++i) {
    const CellIndex cell = raster.CellOf(i);
    const bool is_wall = cell.row % 200 < 3 || cell.col % 200 < 3;
    raster.mutable_values()[i] = is_wall ? Coverage::kNone : Coverage::kUnexplored;
  }
  std::vector<CellIndex> changed;
  for (int i = 0; i < 400; ++i) {
    const CellIndex centre{testing::UniformInt(rng, 0, kSide - 1),
                           testing::UniformInt(rng, 0, kSide - 1)};
    Cover(centre, kRange, Coverage::kExplored, &raster, &changed);
  }
  return raster;
}

int64_t NumCells(const Frontiers& frontiers) {
  const std::vector<Frontier> all = frontiers.All();
  return std::accumulate(
      all.begin(), all.end(), static_cast<int64_t>(all.size()) << 32,
      [](int64_t sum, const Frontier& f) { return sum + static_cast<int64_t>(f.size()); });
}

// The area that a robot sees is marked as explored, and as unexplored again before the next
// iteration: two updates each.
void FrontiersAfterObservation(benchmark::State& state, bool run_brute_force) {
  testing::Rng rng(1);
  CoverageRaster raster = HalfSeen(rng);
  Frontiers followed(raster);
  std::vector<CellIndex> places;
  for (int i = 0; i < 8; ++i) {
    places.push_back(
        {testing::UniformInt(rng, 0, kSide - 1), testing::UniformInt(rng, 0, kSide - 1)});
  }
  const auto ask = [&](const CellIndex& place, auto frontiers_after) {
    std::vector<CellIndex> changed;
    Cover(place, kRange, Coverage::kExplored, &raster, &changed);
    const size_t num_frontiers = frontiers_after(changed);
    for (const CellIndex& cell : changed) raster.set(cell, Coverage::kUnexplored);
    return num_frontiers + frontiers_after(changed);
  };
  Compare(
      state, places, run_brute_force,
      [&](const CellIndex& place) {
        return ask(place, [&](const std::vector<CellIndex>& changed) {
          followed.Update(raster, changed);
          return followed.size();
        });
      },
      [&](const CellIndex& place) {
        return ask(place, [&](const std::vector<CellIndex>&) { return Frontiers(raster).size(); });
      });
  if (NumCells(followed) != NumCells(Frontiers(raster))) state.SkipWithError("frontiers differ");
}

BENCHMARK_CAPTURE(FrontiersAfterObservation, fast, false)->Name("frontiers_after_observation");
BENCHMARK_CAPTURE(FrontiersAfterObservation, slow, true)
    ->Name("frontiers_after_observation/brute_force");

}  // namespace
}  // namespace hypermap
