#include "ingest/perception/footprint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "ingest/perception/depth_noise.h"
#include "map/geometry/convex_hull.h"

namespace hypermap::ingest {
namespace {

constexpr double kFineCell_m = 0.01;
constexpr double kCoarseCell_m = 0.025;
constexpr double kFineExtent_m = 0.45;
constexpr int kSmoothingReach_px = 2;
// Of more pixels only those of every second, third ... row and column become points.
constexpr size_t kMaxPoints = 6000;
// Clumps with a smaller share of the points than this are strays.
constexpr double kStrayShare = 0.05;

// Positions along the frame's axes, from the cloud's foot.
using Points = std::vector<Eigen::Vector3f>;

// Moves each point along its ray to the mean depth of its neighbours on the same surface.
// Only of every `stride`-th row and column.
Points Smoothed(const OrganisedCloud& cloud, const std::vector<int32_t>& pixels, int stride,
                const FootprintOptions& options) {
  std::vector<uint8_t> kept(cloud.camera.size(), 0);
  for (const int32_t pixel : pixels) kept[pixel] = 1;
  Points points;
  // Of many pixels fewer neighbours do.
  const int step = stride > 2 ? kSmoothingReach_px : 1;
  for (const int32_t pixel : pixels) {
    if (pixel % cloud.width % stride != 0 || pixel / cloud.width % stride != 0) continue;
    const float z = cloud.camera[pixel].z();
    const float same = 3.0f * DepthSigma(z) + 0.005f;
    const int u = pixel % cloud.width;
    const int v = pixel / cloud.width;
    float sum = 0.0f;
    int count = 0;
    for (int dv = -kSmoothingReach_px; dv <= kSmoothingReach_px; dv += step) {
      if (v + dv < 0 || v + dv >= cloud.height) continue;
      for (int du = -kSmoothingReach_px; du <= kSmoothingReach_px; du += step) {
        if (u + du < 0 || u + du >= cloud.width) continue;
        const int32_t other = pixel + dv * cloud.width + du;
        if (!kept[other]) continue;
        const float dz = cloud.camera[other].z() - z;
        if (std::abs(dz) > same) continue;
        sum += dz;
        ++count;
      }
    }
    const float scale = 1.0f + sum / static_cast<float>(count) / z;
    Eigen::Vector3f p = cloud.upright[pixel];
    const Eigen::Vector3f eye(0.0f, 0.0f, cloud.height_of_camera);
    p = eye + scale * (p - eye);
    if (p.z() < options.floor_m || (p - eye).norm() > options.max_range_m) continue;
    points.push_back(p);
  }
  return points;
}

CellIndex CellOf(const Eigen::Vector3f& p, double resolution_m) {
  return {static_cast<int32_t>(std::floor(p.y() / resolution_m)),
          static_cast<int32_t>(std::floor(p.x() / resolution_m))};
}

// Leaves out the points of clumps (cells that touch) with few points.
Points WithoutStrays(const Points& points, double cell_m) {
  CellBox box;
  std::vector<CellIndex> cell_of;
  cell_of.reserve(points.size());
  for (const auto& p : points) {
    const CellIndex c = CellOf(p, cell_m);
    cell_of.push_back(c);
    box = box.Union({c.row, c.row + 1, c.col, c.col + 1});
  }
  const auto cols = static_cast<int>(box.cols());
  const auto rows = static_cast<int>(box.rows());
  const auto index = [&](const CellIndex& c) {
    return static_cast<size_t>(c.row - box.row_begin) * cols + (c.col - box.col_begin);
  };
  std::vector<int> count(static_cast<size_t>(rows) * cols, 0);
  for (const CellIndex& c : cell_of) ++count[index(c)];
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
  Points kept;
  kept.reserve(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    if (count[index(cell_of[i])] == kKept) kept.push_back(points[i]);
  }
  return kept;
}

// Leaves out points that lie well inside the octagon of the extreme ones, so that the hull has
// less to sort (Akl and Toussaint 1978).
std::vector<Point> OuterPositions(const Points& points, const Eigen::Vector2d& foot) {
  std::array<const Eigen::Vector3f*, 8> extreme;
  extreme.fill(&points.front());
  // Counter-clockwise.
  constexpr std::array<std::pair<float, float>, 8> kDirections = {
      {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
  const auto along = [&](size_t k, const Eigen::Vector3f& p) {
    return kDirections[k].first * p.x() + kDirections[k].second * p.y();
  };
  for (const auto& p : points) {
    for (size_t k = 0; k < extreme.size(); ++k) {
      if (along(k, p) > along(k, *extreme[k])) extreme[k] = &p;
    }
  }
  std::vector<Point> outer;
  for (const auto& p : points) {
    bool inside = true;
    for (size_t k = 0; k < extreme.size() && inside; ++k) {
      const Eigen::Vector3f& a = *extreme[k];
      const Eigen::Vector3f& b = *extreme[(k + 1) % extreme.size()];
      const Eigen::Vector2f edge = (b - a).head<2>();
      if (edge.squaredNorm() == 0.0f) continue;
      const float left = edge.x() * (p.y() - a.y()) - edge.y() * (p.x() - a.x());
      inside = left > 1e-4f * edge.norm();
    }
    if (!inside) outer.push_back({foot.x() + p.x(), foot.y() + p.y()});
  }
  return outer;
}

CellPatch CellsOf(const Points& points, const Eigen::Vector2d& foot, double resolution_m) {
  std::vector<CellIndex> cells;
  cells.reserve(points.size());
  for (const auto& p : points) cells.push_back(CellOf(p, resolution_m));
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  CellPatch patch;
  patch.frame_from_cells = PlanarTransform(foot.x(), foot.y(), 0.0);
  patch.resolution_m = resolution_m;
  for (const CellIndex& c : cells) {
    if (!patch.spans.empty() && patch.spans.back().row == c.row &&
        patch.spans.back().col_end == c.col) {
      ++patch.spans.back().col_end;
    } else {
      patch.spans.push_back({c.row, c.col, c.col + 1});
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
  Points points = Smoothed(cloud, pixels, stride, options);
  if (static_cast<int>(points.size()) < options.min_points) return std::nullopt;
  float mean_range = 0.0f;
  for (const auto& p : points) mean_range += p.norm();
  mean_range /= static_cast<float>(points.size());
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
  footprint.hull = ConvexHull(OuterPositions(points, cloud.foot));
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
