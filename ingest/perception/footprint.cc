#include "ingest/perception/footprint.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "ingest/perception/smoothing.h"
#include "map/geometry/convex_hull.h"

namespace hypermap::ingest {
namespace {

constexpr double kFineCell_m = 0.01;
constexpr double kCoarseCell_m = 0.025;
constexpr double kFineExtent_m = 0.45;
// Objects with more pixels are thinned to every second, third, ... row and column.
constexpr size_t kMaxPoints = 6000;
// Clumps with a smaller share of the points than this are strays: a convex hull would extend to
// each of them.
constexpr double kStrayShare = 0.05;

// Positions relative to the cloud's foot, along the axes of the pose's frame.
using Positions = std::vector<Eigen::Vector3f>;

// Returns the smoothed points of every `stride`-th row and column of `pixels` that are above the
// floor and within range.
Positions PointsOf(const OrganisedCloud& cloud, const std::vector<int32_t>& pixels, int stride,
                   const FootprintOptions& options) {
  Positions points = SmoothedFromCamera(cloud, pixels, stride);
  size_t kept = 0;
  for (const Eigen::Vector3f& from_eye : points) {
    const float z = from_eye.z() + cloud.height_of_camera;
    // Also leaves out points that are not finite.
    if (!(z >= options.floor_m && from_eye.norm() <= options.max_range_m)) continue;
    points[kept++] = {from_eye.x(), from_eye.y(), z};
  }
  points.resize(kept);
  return points;
}

// Equals std::floor(x) for values in the range of int32_t, but needs no call of the library:
// baseline x86-64 has no instruction for floor.
int32_t Floor(double x) {
  const auto towards_zero = static_cast<int32_t>(x);
  return towards_zero - (towards_zero > x);
}

// The cells of a grid on the plane that points lie in, as row-major indices into the bounding box
// of these cells. REQUIRES: the points are finite and within max_range_m of the foot, so that the
// box is small.
struct FlatGrid {
  FlatGrid(const Positions& points, double resolution_m) {
    constexpr int32_t kMost = std::numeric_limits<int32_t>::max();
    std::vector<CellIndex> cells;
    cells.reserve(points.size());
    first = {kMost, kMost};
    CellIndex last = {-kMost, -kMost};
    for (const auto& p : points) {
      const CellIndex c = {Floor(p.y() / resolution_m), Floor(p.x() / resolution_m)};
      cells.push_back(c);
      first = {std::min(first.row, c.row), std::min(first.col, c.col)};
      last = {std::max(last.row, c.row), std::max(last.col, c.col)};
    }
    if (points.empty()) return;
    rows = last.row - first.row + 1;
    cols = last.col - first.col + 1;
    cell_of.reserve(points.size());
    for (const CellIndex& c : cells) {
      cell_of.push_back(static_cast<size_t>(c.row - first.row) * cols + (c.col - first.col));
    }
  }

  size_t size() const { return static_cast<size_t>(rows) * cols; }

  CellIndex first;
  int rows = 0;
  int cols = 0;
  std::vector<size_t> cell_of;  // The cell of each point.
};

// Returns the points without those of small clumps. A clump is a set of cells that touch, also
// diagonally.
Positions WithoutStrays(const Positions& points, double cell_m) {
  const FlatGrid grid(points, cell_m);
  const int rows = grid.rows;
  const int cols = grid.cols;
  std::vector<int> count(grid.size(), 0);
  for (const size_t cell : grid.cell_of) ++count[cell];
  constexpr int kStray = -1;
  constexpr int kKept = -2;
  std::vector<size_t> clump;
  for (size_t start = 0; start < count.size(); ++start) {
    if (count[start] <= 0) continue;
    int sum = count[start];
    clump.assign(1, start);
    count[start] = kStray;
    for (size_t next = 0; next < clump.size(); ++next) {
      const auto row = static_cast<int>(clump[next] / cols);
      const auto col = static_cast<int>(clump[next] % cols);
      for (int r = std::max(0, row - 1); r <= std::min(rows - 1, row + 1); ++r) {
        for (int c = std::max(0, col - 1); c <= std::min(cols - 1, col + 1); ++c) {
          const size_t other = static_cast<size_t>(r) * cols + c;
          if (count[other] <= 0) continue;
          sum += count[other];
          count[other] = kStray;
          clump.push_back(other);
        }
      }
    }
    if (sum < kStrayShare * points.size()) continue;
    for (const size_t cell : clump) count[cell] = kKept;
  }
  Positions kept;
  kept.reserve(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    if (count[grid.cell_of[i]] == kKept) kept.push_back(points[i]);
  }
  return kept;
}

CellPatch CellsOf(const Positions& points, const Eigen::Vector2d& foot, double resolution_m) {
  const FlatGrid grid(points, resolution_m);
  std::vector<uint8_t> taken(grid.size(), 0);
  for (const size_t cell : grid.cell_of) taken[cell] = 1;
  CellPatch patch;
  patch.frame_from_cells = PlanarTransform(foot.x(), foot.y(), 0.0);
  patch.resolution_m = resolution_m;
  for (int row = 0; row < grid.rows; ++row) {
    const uint8_t* cells = taken.data() + static_cast<size_t>(row) * grid.cols;
    for (int col = 0; col < grid.cols; ++col) {
      if (!cells[col]) continue;
      const int begin = col;
      while (col < grid.cols && cells[col]) ++col;
      patch.spans.push_back({grid.first.row + row, grid.first.col + begin, grid.first.col + col});
    }
  }
  return patch;
}

}  // namespace

std::optional<Footprint> MakeFootprint(const OrganisedCloud& cloud,
                                       const std::vector<int32_t>& pixels,
                                       const FootprintOptions& options) {
  int stride = 1;
  while (pixels.size() / (static_cast<size_t>(stride) * stride) > kMaxPoints) ++stride;
  Positions points = PointsOf(cloud, pixels, stride, options);
  if (static_cast<int>(points.size()) < options.min_points) return std::nullopt;
  float mean_range = 0.0f;
  for (const auto& p : points) mean_range += p.norm();
  mean_range /= static_cast<float>(points.size());
  // The distance between the rays of neighbouring pixels grows with range and stride, and cells
  // grow with it, so that points of one surface stay in cells that touch.
  points = WithoutStrays(points, std::max(0.03, 0.012 * mean_range * stride));
  if (static_cast<int>(points.size()) < options.min_points) return std::nullopt;

  Footprint footprint;
  Eigen::Vector3f low = points.front();
  Eigen::Vector3f high = points.front();
  double range = 0.0;
  const Eigen::Vector3f eye(0.0f, 0.0f, cloud.height_of_camera);
  for (const auto& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
    range += (p - eye).norm();
  }
  std::vector<Point> positions;
  positions.reserve(points.size());
  for (const auto& p : points) {
    positions.push_back({cloud.foot.x() + p.x(), cloud.foot.y() + p.y()});
  }
  footprint.hull = ConvexHull(std::move(positions));
  // A hull below a square millimetre is a line with noise.
  if (footprint.hull.empty() || Area(footprint.hull) < 1e-6) return std::nullopt;
  const double extent = std::max(high.x() - low.x(), high.y() - low.y());
  footprint.cells =
      CellsOf(points, cloud.foot, extent < kFineExtent_m ? kFineCell_m : kCoarseCell_m);
  footprint.height = {low.z(), high.z()};
  footprint.num_points = static_cast<int>(points.size()) * stride * stride;
  footprint.range_m = range / static_cast<double>(points.size());
  return footprint;
}

}  // namespace hypermap::ingest
