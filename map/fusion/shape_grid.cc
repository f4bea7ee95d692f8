#include "map/fusion/shape_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "map/geometry/convex_hull.h"

namespace hypermap::fusion {
namespace {

// A box grows by this many cells more than it must, because growing copies the grid.
constexpr int32_t kSlack = 8;
// A grid that absorbs a larger one adopts its cell size if it would otherwise get more cells than
// this.
constexpr double kMaxCells = 1e6;
// Polygons that reach beyond this row or column are left out: cells are numbered by int32.
constexpr double kMaxIndex = 1e9;

}  // namespace

void ShapeGrid::Reserve(const CellBox& box) {
  const CellBox grown = box_.Union(box);
  if (grown == box_) return;
  ShapeGrid larger(resolution_m_);
  larger.box_ = grown;
  larger.hit_.resize(static_cast<size_t>(grown.num_cells()), 0.0f);
  larger.miss_.resize(static_cast<size_t>(grown.num_cells()), 0.0f);
  for (int32_t row = box_.row_begin; row < box_.row_end; ++row) {
    const size_t from = At({row, box_.col_begin});
    const size_t to = larger.At({row, box_.col_begin});
    const auto n = static_cast<size_t>(box_.cols());
    std::copy_n(hit_.begin() + from, n, larger.hit_.begin() + to);
    std::copy_n(miss_.begin() + from, n, larger.miss_.begin() + to);
  }
  *this = std::move(larger);
}

size_t ShapeGrid::Grown(const CellIndex& cell) {
  if (!box_.Contains(cell)) {
    Reserve({cell.row - kSlack, cell.row + kSlack + 1, cell.col - kSlack, cell.col + kSlack + 1});
  }
  return At(cell);
}

void ShapeGrid::AddMiss(const CellIndex& cell, float weight) {
  if (box_.Contains(cell)) miss_[At(cell)] += weight;
}

double ShapeGrid::Occupancy(const CellIndex& cell, double doubt) const {
  if (!box_.Contains(cell)) return 0.0;
  const size_t i = At(cell);
  return hit_[i] / (hit_[i] + miss_[i] + doubt);
}

void ShapeGrid::Absorb(const ShapeGrid& other) {
  if (other.box_.empty()) return;
  const double ratio = other.resolution_m_ / resolution_m_;
  if (static_cast<double>(other.box_.num_cells()) * ratio * ratio > kMaxCells) {
    *this = Resampled(other.resolution_m_);
  }
  if (other.resolution_m_ != resolution_m_) {
    Absorb(other.Resampled(resolution_m_));
    return;
  }
  Reserve(other.box_);
  for (int32_t row = other.box_.row_begin; row < other.box_.row_end; ++row) {
    for (int32_t col = other.box_.col_begin; col < other.box_.col_end; ++col) {
      hit_[At({row, col})] += other.hit_[other.At({row, col})];
      miss_[At({row, col})] += other.miss_[other.At({row, col})];
    }
  }
}

ShapeGrid ShapeGrid::Resampled(double resolution_m) const {
  ShapeGrid resampled(resolution_m);
  if (box_.empty()) return resampled;
  const double ratio = resolution_m_ / resolution_m;
  const auto begin = [&](int32_t i) { return static_cast<int32_t>(std::floor(i * ratio)); };
  const auto end = [&](int32_t i) { return static_cast<int32_t>(std::ceil(i * ratio)); };
  resampled.Reserve(
      {begin(box_.row_begin), end(box_.row_end), begin(box_.col_begin), end(box_.col_end)});
  for (int32_t row = resampled.box_.row_begin; row < resampled.box_.row_end; ++row) {
    for (int32_t col = resampled.box_.col_begin; col < resampled.box_.col_end; ++col) {
      const CellIndex source{static_cast<int32_t>(std::floor((row + 0.5) / ratio)),
                             static_cast<int32_t>(std::floor((col + 0.5) / ratio))};
      if (!box_.Contains(source)) continue;
      // Evidence is weighted per view and not per area, so that cells keep their values.
      resampled.hit_[resampled.At({row, col})] = hit_[At(source)];
      resampled.miss_[resampled.At({row, col})] = miss_[At(source)];
    }
  }
  return resampled;
}

Polygon ShapeGrid::Hull(double threshold, double doubt) const {
  std::vector<uint8_t> state(hit_.size(), 0);  // 1: above the threshold; 2: visited.
  for (size_t i = 0; i < hit_.size(); ++i) {
    state[i] = hit_[i] > threshold * (hit_[i] + miss_[i] + doubt);
  }
  const auto cols = static_cast<size_t>(box_.cols());
  std::vector<size_t> largest;
  std::vector<size_t> part;
  for (size_t start = 0; start < state.size(); ++start) {
    if (state[start] != 1) continue;
    part.assign(1, start);
    state[start] = 2;
    for (size_t next = 0; next < part.size(); ++next) {
      const auto row = static_cast<int64_t>(part[next] / cols);
      const auto col = static_cast<int64_t>(part[next] % cols);
      for (int64_t r = std::max<int64_t>(0, row - 1); r <= std::min(box_.rows() - 1, row + 1);
           ++r) {
        for (int64_t c = std::max<int64_t>(0, col - 1); c <= std::min(box_.cols() - 1, col + 1);
             ++c) {
          const auto i = static_cast<size_t>(r) * cols + static_cast<size_t>(c);
          if (state[i] != 1) continue;
          state[i] = 2;
          part.push_back(i);
        }
      }
    }
    if (part.size() > largest.size()) std::swap(largest, part);
  }
  // Only the first and last cell of each row can be corners of the hull.
  struct Ends {
    size_t first = SIZE_MAX;
    size_t last = 0;
  };
  std::vector<Ends> rows(static_cast<size_t>(box_.rows()));
  for (const size_t i : largest) {
    Ends& ends = rows[i / cols];
    ends.first = std::min(ends.first, i % cols);
    ends.last = std::max(ends.last, i % cols + 1);
  }
  std::vector<Point> corners;
  for (size_t row = 0; row < rows.size(); ++row) {
    if (rows[row].first == SIZE_MAX) continue;
    for (const size_t col : {rows[row].first, rows[row].last}) {
      const double x = (box_.col_begin + static_cast<double>(col)) * resolution_m_;
      const double y = (box_.row_begin + static_cast<double>(row)) * resolution_m_;
      corners.push_back({x, y});
      corners.push_back({x, y + resolution_m_});
    }
  }
  return ConvexHull(std::move(corners));
}

ShapeGrid ShapeGrid::FromRaw(double resolution_m, const CellBox& box, std::vector<float> hits,
                             std::vector<float> misses) {
  ShapeGrid grid(resolution_m);
  grid.box_ = box;
  grid.hit_ = std::move(hits);
  grid.miss_ = std::move(misses);
  return grid;
}

void ForEachSpan(const Polygon& convex, double resolution_m,
                 absl::FunctionRef<void(int32_t, int32_t, int32_t)> visit) {
  if (convex.empty()) return;
  const Ring& ring = convex.outer();
  const Box& bounds = convex.bounds();
  const double farthest = std::max({std::abs(bounds.min.x), std::abs(bounds.min.y),
                                    std::abs(bounds.max.x), std::abs(bounds.max.y)});
  if (farthest > kMaxIndex * resolution_m) return;
  const auto first = static_cast<int32_t>(std::ceil(bounds.min.y / resolution_m - 0.5));
  const auto last = static_cast<int32_t>(std::floor(bounds.max.y / resolution_m - 0.5));
  for (int32_t row = first; row <= last; ++row) {
    const double y = (row + 0.5) * resolution_m;
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (size_t i = 0; i < ring.size(); ++i) {
      const Point& a = ring[i];
      const Point& b = ring[(i + 1) % ring.size()];
      if ((a.y < y) == (b.y < y) && a.y != y && b.y != y) continue;
      if (a.y == b.y) {
        low = std::min({low, a.x, b.x});
        high = std::max({high, a.x, b.x});
        continue;
      }
      const double t = (y - a.y) / (b.y - a.y);
      if (t < 0.0 || t > 1.0) continue;
      const double x = a.x + t * (b.x - a.x);
      low = std::min(low, x);
      high = std::max(high, x);
    }
    if (low > high) continue;  // Rounding put the row just outside the polygon.
    const auto begin = static_cast<int32_t>(std::ceil(low / resolution_m - 0.5));
    const auto end = static_cast<int32_t>(std::floor(high / resolution_m - 0.5)) + 1;
    if (begin < end) visit(row, begin, end);
  }
}

}  // namespace hypermap::fusion
