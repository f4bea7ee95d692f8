#include "ingest/perception/wall_matcher.h"

#include <algorithm>
#include <cmath>

namespace hypermap::ingest {
namespace {

// Distances are capped here: a point farther from every occupied cell is no wall of the grid, and
// the constant distance gives it no gradient.
constexpr double kReach_m = 0.5;
// Range of heights that a planar laser maps, and so the only one in which the grid has walls.
constexpr float kBandLow_m = 0.15f;
constexpr float kBandHigh_m = 0.65f;
// The points in a bin are upright structure if they extend over at least this height and are at
// least this many. Level surfaces, such as table tops, are not in the grid.
constexpr float kMinHeight_m = 0.08f;
constexpr int kMinPoints = 3;
// Beyond this range depth noise (6 cm there) exceeds the size of a bin.
constexpr float kFarthest_m = 6.0f;
constexpr double kBin_m = 0.05;
// Standard deviation between the grid's walls and the true ones.
constexpr double kWallSigma_m = 0.04;
// Distance along a wall at which errors of the grid are independent. The bins in between share
// their error, so that together they count as one measurement.
constexpr double kIndependent_m = 0.5;
// Most rounds of Gauss-Newton; the kernel has its final width from the fifth on.
constexpr int kRounds = 12;
// With fewer bins of walls a frame is not matched.
constexpr int kMinBins = 8;

// Standard deviations of a pose that the grid can't improve: its walls lie on one side or the other
// of a cell.
constexpr double kKnownCells = 0.2;
constexpr double kKnownYaw_rad = 0.005;

// Number of bins on each side of the foot: 8 m.
constexpr int kBinsAside = 160;
constexpr float kNearest_m = 0.3f;

// The points above one bin of the plane.
struct Column {
  float x_sum = 0.0f;
  float y_sum = 0.0f;
  int count = 0;
  float low = 1e9f;
  float high = -1e9f;
};

// Returns the mean positions, relative to the cloud's foot, of the points in bins with upright
// structure. Each bin counts once, so that near walls, which have more pixels, do not dominate.
std::vector<Eigen::Vector2d> Walls(const OrganisedCloud& cloud) {
  constexpr int kSide = 2 * kBinsAside;
  std::vector<Column> columns(static_cast<size_t>(kSide) * kSide);
  const int step = std::max(1, cloud.width / 160);
  for (int v = 0; v < cloud.height; v += step) {
    for (int u = 0; u < cloud.width; u += step) {
      const int32_t i = v * cloud.width + u;
      const float depth = cloud.camera[i].z();
      if (!(depth >= kNearest_m && depth <= kFarthest_m)) continue;
      const Eigen::Vector3f p = cloud.upright(i);
      if (!(p.z() >= kBandLow_m && p.z() <= kBandHigh_m)) continue;
      const double col = kBinsAside + std::floor(p.x() / kBin_m);
      const double row = kBinsAside + std::floor(p.y() / kBin_m);
      // False also for a point that is not finite.
      if (!(col >= 0.0 && row >= 0.0 && col < kSide && row < kSide)) continue;
      Column& column = columns[static_cast<size_t>(row) * kSide + static_cast<size_t>(col)];
      column.x_sum += p.x();
      column.y_sum += p.y();
      ++column.count;
      column.low = std::min(column.low, p.z());
      column.high = std::max(column.high, p.z());
    }
  }
  std::vector<Eigen::Vector2d> walls;
  for (const Column& column : columns) {
    if (column.count < kMinPoints || column.high - column.low < kMinHeight_m) continue;
    walls.emplace_back(column.x_sum / column.count, column.y_sum / column.count);
  }
  return walls;
}

}  // namespace

WallMatcher::WallMatcher(const GridLayer& occupancy)
    : resolution_m_(occupancy.geometry().resolution_m),
      distance_(
          occupancy.geometry(), occupancy.extent(),
          [&](const CellIndex& cell) {
            const auto value = occupancy.ValueAt(cell);
            return value && *value > occupancy.spec().thresholds.occupied_above;
          },
          kReach_m) {}

PoseCorrection WallMatcher::Match(const OrganisedCloud& cloud, const Eigen::Matrix3d& prior) const {
  PoseCorrection correction;
  correction.covariance = prior;
  if (distance_.empty() || prior.llt().info() != Eigen::Success) return correction;
  const double known_m = kKnownCells * resolution_m_;
  if (prior(0, 0) <= known_m * known_m && prior(1, 1) <= known_m * known_m &&
      prior(2, 2) <= kKnownYaw_rad * kKnownYaw_rad) {
    return correction;
  }
  const std::vector<Eigen::Vector2d> walls = Walls(cloud);
  if (static_cast<int>(walls.size()) < kMinBins) return correction;
  // The prior damps the steps: where no wall tells the pose, such as along a corridor, the motion
  // stays near 0.
  const Eigen::Matrix3d prior_information = prior.inverse();
  // Without this factor the covariance would shrink as if each bin were an independent measurement.
  const double share = kBin_m / kIndependent_m;
  Eigen::Matrix3d information = prior_information;
  for (int round = 0; round < kRounds; ++round) {
    // A wide kernel finds the right wall from a wrong pose, and a narrow one then finds its exact
    // place without the pull of other structure.
    const double kernel = std::max(0.10, 0.25 * std::pow(0.75, round));
    information = prior_information;
    Eigen::Vector3d gradient = prior_information * correction.motion;
    const double c = std::cos(correction.motion.z());
    const double s = std::sin(correction.motion.z());
    for (const Eigen::Vector2d& wall : walls) {
      const Eigen::Vector2d turned(c * wall.x() - s * wall.y(), s * wall.x() + c * wall.y());
      const DistanceField::Sample sample =
          distance_.At(cloud.foot + correction.motion.head<2>() + turned);
      const double ratio = sample.distance_m / kernel;
      const double robust = 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio));
      const double weight = share * robust / (kWallSigma_m * kWallSigma_m);
      const Eigen::Vector3d jacobian(sample.gradient.x(), sample.gradient.y(),
                                     sample.gradient.dot(Eigen::Vector2d(-turned.y(), turned.x())));
      information += weight * jacobian * jacobian.transpose();
      gradient += weight * sample.distance_m * jacobian;
    }
    const Eigen::Vector3d step = information.ldlt().solve(gradient);
    correction.motion -= step;
    if (step.head<2>().norm() < 1e-5 && std::abs(step.z()) < 1e-6) break;
  }
  correction.covariance = information.inverse();
  // The inverse is not finite if the prior is nearly singular.
  if (!correction.motion.allFinite() || !correction.covariance.allFinite()) {
    return {Eigen::Vector3d::Zero(), prior};
  }
  return correction;
}

}  // namespace hypermap::ingest
