#include "tests/registration/trial.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "map/layers/layer_registry.h"

namespace hypermap::registration {
namespace {

using Rng = std::mt19937_64;

// Not those of the standard library, whose results differ from one to the other.
double Uniform(Rng& rng, double low, double high) {
  return low + (high - low) * (static_cast<double>(rng() >> 11) * 0x1.0p-53);
}

struct Known {
  CellIndex cell;
  Point place;
};

std::vector<Known> KnownCells(const GridLayer& grid) {
  std::vector<Known> known;
  const CellBox& box = grid.extent();
  for (int32_t row = box.row_begin; row < box.row_end; ++row) {
    for (int32_t col = box.col_begin; col < box.col_end; ++col) {
      if (!grid.ValueAt({row, col})) continue;
      known.push_back({{row, col}, grid.geometry().CentreOf({row, col})});
    }
  }
  return known;
}

// Returns a grid that looks up each cell in `grid`, in a frame that is turned and shifted by
// `new_from_old`.
std::shared_ptr<const GridLayer> Resampled(const GridLayer& grid,
                                           const PlanarTransform& new_from_old,
                                           double resolution_m) {
  LayerSpec spec = grid.spec();
  spec.grid = GridGeometry{.resolution_m = resolution_m};
  const Box bounds = BoundsOf(new_from_old, grid.Bounds());
  const CellIndex low = *spec.grid->CellAt(bounds.min);
  const CellIndex high = *spec.grid->CellAt(bounds.max);
  const CellBox box{low.row, high.row + 1, low.col, high.col + 1};
  std::vector<std::optional<double>> values;
  values.reserve(static_cast<size_t>(box.num_cells()));
  for (int32_t row = box.row_begin; row < box.row_end; ++row) {
    for (int32_t col = box.col_begin; col < box.col_end; ++col) {
      const Point place = new_from_old.ApplyInverse(spec.grid->CentreOf({row, col}));
      const auto cell = grid.geometry().CellAt(place);
      values.push_back(cell ? grid.ValueAt(*cell) : std::nullopt);
    }
  }
  GridWriter writer(AsGrid(MakeEmptyLayer(spec)));
  writer.Write(box, values).IgnoreError();
  return std::move(writer).Finish().layer;
}

void Set(const CellIndex& c, std::optional<double> value, GridWriter* writer) {
  writer->Write({c.row, c.row + 1, c.col, c.col + 1}, {value}).IgnoreError();
}

// Returns the grid without the share of its known cells for which `rank` is least.
template <typename Rank>
std::shared_ptr<const GridLayer> Without(double share, std::shared_ptr<const GridLayer> grid,
                                         Rank rank) {
  std::vector<Known> known = KnownCells(*grid);
  const auto end =
      known.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(known.size()));
  std::nth_element(known.begin(), end, known.end(),
                   [&](const Known& a, const Known& b) { return rank(a.place) < rank(b.place); });
  GridWriter writer(std::move(grid));
  for (auto it = known.begin(); it != end; ++it) Set(it->cell, std::nullopt, &writer);
  return std::move(writer).Finish().layer;
}

std::shared_ptr<const GridLayer> Cut(double share, std::shared_ptr<const GridLayer> grid,
                                     Rng& rng) {
  if (rng() % 2 == 0) {
    const double angle = Uniform(rng, 0.0, 2.0 * std::numbers::pi);
    return Without(share, std::move(grid),
                   [=](const Point& p) { return std::cos(angle) * p.x + std::sin(angle) * p.y; });
  }
  const std::vector<Known> known = KnownCells(*grid);
  const Point middle = known[rng() % known.size()].place;
  return Without(share, std::move(grid),
                 [=](const Point& p) { return std::hypot(p.x - middle.x, p.y - middle.y); });
}

// Returns the grid with this share of the occupied cells freed, and as many free cells occupied.
std::shared_ptr<const GridLayer> Changed(double share, std::shared_ptr<const GridLayer> grid,
                                         Rng& rng) {
  std::vector<Known> known = KnownCells(*grid);
  const OccupancyThresholds& thresholds = grid->spec().thresholds;
  std::vector<CellIndex> freed;
  std::vector<CellIndex> free;
  for (const Known& place : known) {
    const double value = *grid->ValueAt(place.cell);
    if (value > thresholds.occupied_above && Uniform(rng, 0.0, 1.0) < share) {
      freed.push_back(place.cell);
    }
    if (value < thresholds.free_below) free.push_back(place.cell);
  }
  GridWriter writer(std::move(grid));
  for (const CellIndex& cell : freed) {
    Set(cell, 0.0, &writer);
    Set(free[rng() % free.size()], 1.0, &writer);
  }
  return std::move(writer).Finish().layer;
}

}  // namespace

Trial MakeTrial(const std::shared_ptr<const GridLayer>& grid, const TrialOptions& options,
                uint64_t seed) {
  Rng rng(seed);
  const double yaw = Uniform(rng, -std::numbers::pi, std::numbers::pi);
  const double x = Uniform(rng, -20.0, 20.0);
  const double y = Uniform(rng, -20.0, 20.0);
  const PlanarTransform new_from_old(x, y, yaw);
  const double resolution_m = grid->geometry().resolution_m * Uniform(rng, 0.8, 1.25);
  auto copy = Cut(options.cut, Resampled(*grid, new_from_old, resolution_m), rng);
  if (options.changed > 0.0) copy = Changed(options.changed, std::move(copy), rng);
  if (rng() % 2 == 0) return {std::move(copy), grid, new_from_old.Inverse()};
  return {grid, std::move(copy), new_from_old};
}

Outcome Compare(const TransformEstimate& estimate, const PlanarTransform& truth) {
  const PlanarTransform& found = estimate.best.target_from_source;
  const Eigen::Vector3d error(found.x() - truth.x(), found.y() - truth.y(),
                              std::remainder(found.yaw() - truth.yaw(), 2.0 * std::numbers::pi));
  Outcome outcome;
  outcome.offset_m = error.head<2>().norm();
  outcome.yaw_rad = std::abs(error.z());
  outcome.mahalanobis = error.dot(estimate.covariance.ldlt().solve(error));
  if (estimate.ambiguity != Ambiguity::kNone) return outcome;
  const bool is_right = outcome.offset_m <= kRightWithin_m && outcome.yaw_rad <= kRightWithin_rad;
  outcome.verdict = is_right ? Verdict::kRight : Verdict::kWrong;
  return outcome;
}

}  // namespace hypermap::registration
