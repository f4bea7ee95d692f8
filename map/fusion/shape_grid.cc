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

std::shared_ptr<ShapeGrid::Cells> ShapeGrid::NoCells() {
  // Shared by all grids without cells, so that no grid may change it.
  static const auto* const kNone = new std::shared_ptr<Cells>(std::make_shared<Cells>());
  return *kNone;
}

void ShapeGrid::Reserve(const CellBox& box) {
  const CellBox grown = box_.Union(box);
  if (grown == box_) return;
  ShapeGrid larger(resolution_m_);
  larger.box_ = grown;
  Cells& cells = larger.Own();
  cells.hit.resize(static_cast<size_t>(grown.num_cells()), 0.0f);
  cells.miss.resize(static_cast<size_t>(grown.num_cells()), 0.0f);
  for (int32_t row = box_.row_begin; row < box_.row_end; ++row) {
    const size_t from = At({row, box_.col_begin});
    const size_t to = larger.At({row, box_.col_begin});
    const auto n = static_cast<size_t>(box_.cols());
    std::copy_n(hits().begin() + from, n, cells.hit.begin() + to);
    std::copy_n(misses().begin() + from, n, cells.miss.begin() + to);
  }
  *this = std::move(larger);
}

size_t ShapeGrid::Grown(const CellIndex& cell) {
  if (!box_.Contains(cell)) {
    Reserve({cell.row - kSlack, cell.row + kSlack + 1, cell.col - kSlack, cell.col + kSlack + 1});
  }
  return At(cell);
}

void ShapeGrid::AddHits(int32_t row, int32_t col_begin, int32_t col_end, float weight) {
  float* const hit = Own().hit.data() + At({row, col_begin});
  for (int32_t i = 0; i < col_end - col_begin; ++i) hit[i] += weight;
}

void ShapeGrid::AddMiss(const CellIndex& cell, float weight) {
  if (box_.Contains(cell)) Own().miss[At(cell)] += weight;
}

double ShapeGrid::Occupancy(const CellIndex& cell, double doubt) const {
  if (!box_.Contains(cell)) return 0.0;
  const size_t i = At(cell);
  return hits()[i] / (hits()[i] + misses()[i] + doubt);
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
  Cells& cells = Own();
  for (int32_t row = other.box_.row_begin; row < other.box_.row_end; ++row) {
    for (int32_t col = other.box_.col_begin; col < other.box_.col_end; ++col) {
      cells.hit[At({row, col})] += other.hits()[other.At({row, col})];
      cells.miss[At({row, col})] += other.misses()[other.At({row, col})];
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
  Cells& cells = resampled.Own();
  for (int32_t row = resampled.box_.row_begin; row < resampled.box_.row_end; ++row) {
    for (int32_t col = resampled.box_.col_begin; col < resampled.box_.col_end; ++col) {
      const CellIndex source{static_cast<int32_t>(std::floor((row + 0.5) / ratio)),
                             static_cast<int32_t>(std::floor((col + 0.5) / ratio))};
      if (!box_.Contains(source)) continue;
      // Evidence is weighted per view and not per area, so that cells keep their values.
      cells.hit[resampled.At({row, col})] = hits()[At(source)];
      cells.miss[resampled.At({row, col})] = misses()[At(source)];
    }
  }
  return resampled;
}

std::vector<CellSpan> ShapeGrid::LargestPart(double threshold, double doubt) const {
  const std::vector<float>& hit = hits();
  const std::vector<float>& miss = misses();
  const auto cols = static_cast<size_t>(box_.cols());
  // Rows of cells, each with the number of an earlier one that it is connected with, or its own
  // (disjoint sets; the first of a set stands for it).
  std::vector<CellSpan> spans;
  std::vector<size_t> parents;
  const auto first_of = [&](size_t span) {
    while (parents[span] != span) span = parents[span] = parents[parents[span]];
    return span;
  };
  size_t above = 0;  // the first of the row before
  for (size_t row = 0; row * cols < hit.size(); ++row) {
    const size_t begin = spans.size();
    size_t connected = above;
    for (size_t col = 0; col < cols; ++col) {
      const size_t i = row * cols + col;
      if (!(hit[i] > threshold * (hit[i] + miss[i] + doubt))) continue;
      const auto at = static_cast<int32_t>(col);
      if (spans.size() > begin && spans.back().col_end == at) {
        ++spans.back().col_end;
      } else {
        parents.push_back(spans.size());
        spans.push_back({static_cast<int32_t>(row), at, at + 1});
      }
    }
    for (size_t span = begin; span < spans.size(); ++span) {
      // A span above may touch several of this row.
      while (connected < begin && (spans[connected].row + 1 < spans[span].row ||
                                   spans[connected].col_end < spans[span].col_begin)) {
        ++connected;
      }
      for (size_t other = connected; other < begin && spans[other].col_begin <= spans[span].col_end;
           ++other) {
        const size_t a = first_of(other);
        const size_t b = first_of(span);
        parents[std::max(a, b)] = std::min(a, b);
      }
    }
    above = begin;
  }
  std::vector<int64_t> sizes(spans.size(), 0);
  for (size_t span = 0; span < spans.size(); ++span) {
    sizes[first_of(span)] += spans[span].col_end - spans[span].col_begin;
  }
  const auto largest =
      static_cast<size_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  std::vector<CellSpan> part;
  for (size_t span = 0; span < spans.size(); ++span) {
    if (first_of(span) == largest) part.push_back(spans[span]);
  }
  return part;
}

Polygon ShapeGrid::Hull(double threshold, double doubt) const {
  const std::vector<CellSpan> largest = LargestPart(threshold, doubt);
  // Only the first and last cell of each row can be corners of the hull.
  std::vector<Point> corners;
  for (size_t i = 0; i < largest.size();) {
    const int32_t row = largest[i].row;
    const int32_t first = largest[i].col_begin;
    while (i + 1 < largest.size() && largest[i + 1].row == row) ++i;
    for (const int32_t col : {first, largest[i++].col_end}) {
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
  grid.cells_ = std::make_shared<Cells>(Cells{std::move(hits), std::move(misses)});
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
