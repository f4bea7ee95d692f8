#include "ingest/perception/footprint.h"

#include <algorithm>
#include <cmath>
#include <map>

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
  for (const int32_t pixel : pixels) {
    if (pixel % cloud.width % stride != 0 || pixel / cloud.width % stride != 0) continue;
    const float z = cloud.camera[pixel].z();
    const float same = 3.0f * DepthSigma(z) + 0.005f;
    const int u = pixel % cloud.width;
    const int v = pixel / cloud.width;
    float sum = 0.0f;
    int count = 0;
    for (int dv = -kSmoothingReach_px; dv <= kSmoothingReach_px; ++dv) {
      if (v + dv < 0 || v + dv >= cloud.height) continue;
      for (int du = -kSmoothingReach_px; du <= kSmoothingReach_px; ++du) {
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
  std::map<CellIndex, std::vector<int>> cells;
  for (size_t i = 0; i < points.size(); ++i) {
    cells[CellOf(points[i], cell_m)].push_back(static_cast<int>(i));
  }
  std::map<CellIndex, bool> seen;
  Points kept;
  for (const auto& [start, unused] : cells) {
    if (seen[start]) continue;
    seen[start] = true;
    std::vector<CellIndex> clump = {start};
    size_t count = 0;
    for (size_t next = 0; next < clump.size(); ++next) {
      const CellIndex c = clump[next];
      count += cells[c].size();
      for (int dr = -1; dr <= 1; ++dr) {
        for (int dc = -1; dc <= 1; ++dc) {
          const CellIndex other{c.row + dr, c.col + dc};
          if (!cells.count(other) || seen[other]) continue;
          seen[other] = true;
          clump.push_back(other);
        }
      }
    }
    if (count < kStrayShare * points.size()) continue;
    for (const CellIndex& c : clump) {
      for (const int i : cells[c]) kept.push_back(points[i]);
    }
  }
  return kept;
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
  std::vector<Point> positions;
  positions.reserve(points.size());
  const Eigen::Vector3f eye(0.0f, 0.0f, cloud.height_of_camera);
  for (const auto& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
    range += (p - eye).norm();
    positions.push_back({cloud.foot.x() + p.x(), cloud.foot.y() + p.y()});
  }
  footprint.hull = ConvexHull(std::move(positions));
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
