#include "map/registration/wall_alignment.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/cancellation/cancellation.h"

namespace hypermap::registration {
namespace {

// Most rounds of Gauss-Newton; the kernel is multiplied by kShrink in each until it is narrow.
constexpr int kRounds = 30;
constexpr double kShrink = 0.75;
// Standard deviation between the walls of two grids, and the distance along a wall at which errors
// are independent: nearer walls count together as one measurement.
constexpr double kWallSigma_m = 0.04;
constexpr double kIndependent_m = 0.5;
// Width of the kernel that tells which walls hold a pose.
constexpr double kKernelOfCovariance_m = 0.1;
// Walls agree up to this distance, in cells of the coarser grid.
constexpr double kToleranceCells = 2.5;

std::vector<Eigen::Vector2d> EvenlySpread(const std::vector<Eigen::Vector2d>& walls, size_t most,
                                          const Eigen::Vector2d& origin) {
  const size_t number = std::min(walls.size(), most);
  std::vector<Eigen::Vector2d> chosen(number);
  for (size_t i = 0; i < number; ++i) chosen[i] = walls[i * walls.size() / number] - origin;
  return chosen;
}

// Returns v turned by a right angle, counter-clockwise.
Eigen::Vector2d Turned(const Eigen::Vector2d& v) { return {-v.y(), v.x()}; }

// Sums of what agrees and what contradicts.
struct Tally {
  double agrees = 0.0;
  double contradicts = 0.0;

  void Add(const WallMap& map, const Eigen::Vector2d& place, double tolerance_m) {
    const double ratio = map.distance().DistanceAt(place) / tolerance_m;
    if (ratio < 1.0) {
      agrees += 1.0 - ratio * ratio;
    } else if (map.IsFree(place)) {
      contradicts += 1.0;
    }
  }
};

}  // namespace

WallAlignment::WallAlignment(const WallMap& source, const WallMap& target, size_t most_walls)
    : source_(source),
      target_(target),
      source_walls_(EvenlySpread(source.walls(), most_walls, source.centre())),
      target_walls_(EvenlySpread(target.walls(), most_walls, Eigen::Vector2d::Zero())),
      source_wall_m_(source.length_m() / static_cast<double>(source_walls_.size())),
      target_wall_m_(target.length_m() / static_cast<double>(target_walls_.size())) {}

WallAlignment::Pose WallAlignment::PoseOf(const PlanarTransform& transform) const {
  const Point centre = transform * Point{source_.centre().x(), source_.centre().y()};
  return {{centre.x, centre.y}, transform.yaw()};
}

PlanarTransform WallAlignment::TransformOf(const Pose& pose) const {
  const Eigen::Vector2d origin = pose.centre - Eigen::Rotation2Dd(pose.yaw) * source_.centre();
  return PlanarTransform(origin.x(), origin.y(), pose.yaw);
}

WallAlignment::Normal WallAlignment::NormalAt(const Pose& pose, double kernel_m) const {
  Normal normal;
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(pose.yaw).toRotationMatrix();
  const auto add = [&](double distance_m, const Eigen::Vector3d& jacobian, double wall_m) {
    const double ratio = distance_m / kernel_m;
    const double robust = 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio));
    const double weight = wall_m / kIndependent_m * robust / (kWallSigma_m * kWallSigma_m);
    normal.information += weight * jacobian * jacobian.transpose();
    normal.gradient += weight * distance_m * jacobian;
  };
  for (const Eigen::Vector2d& wall : source_walls_) {
    const Eigen::Vector2d turned = turn * wall;
    const DistanceField::Sample sample = target_.distance().At(pose.centre + turned);
    if (sample.distance_m >= WallMap::kReach_m) continue;
    const Eigen::Vector2d& g = sample.gradient;
    add(sample.distance_m, {g.x(), g.y(), g.dot(Turned(turned))}, source_wall_m_);
  }
  for (const Eigen::Vector2d& wall : target_walls_) {
    const Eigen::Vector2d in_source = turn.transpose() * (wall - pose.centre);
    const DistanceField::Sample sample = source_.distance().At(source_.centre() + in_source);
    if (sample.distance_m >= WallMap::kReach_m) continue;
    const Eigen::Vector2d g = turn * sample.gradient;
    add(sample.distance_m, {-g.x(), -g.y(), -sample.gradient.dot(Turned(in_source))},
        target_wall_m_);
  }
  return normal;
}

PlanarTransform WallAlignment::Refined(const PlanarTransform& start, double kernel_m,
                                       double final_kernel_m) const {
  Pose pose = PoseOf(start);
  // Damps the steps: where no wall tells the pose, such as along a corridor, it stays.
  const Eigen::Matrix3d damping = Eigen::Vector3d(1.0, 1.0, source_.spread_m()).asDiagonal();
  for (int round = 0; round < kRounds && !IsCancelled(); ++round) {
    const Normal normal = NormalAt(pose, kernel_m);
    const Eigen::Vector3d step = (normal.information + damping).ldlt().solve(normal.gradient);
    pose.centre -= step.head<2>();
    pose.yaw -= step.z();
    const bool is_narrow = kernel_m <= final_kernel_m;
    if (is_narrow && step.head<2>().norm() < 1e-5 && std::abs(step.z()) < 1e-6) break;
    kernel_m = std::max(final_kernel_m, kernel_m * kShrink);
  }
  return TransformOf(pose);
}

WallAgreement WallAlignment::AgreementAt(const PlanarTransform& transform) const {
  const Pose pose = PoseOf(transform);
  const Eigen::Rotation2Dd turn(pose.yaw);
  const Eigen::Rotation2Dd back(-pose.yaw);
  const double tolerance_m =
      kToleranceCells * std::max(source_.resolution_m(), target_.resolution_m());
  Tally of_source;
  for (const Eigen::Vector2d& wall : source_walls_) {
    of_source.Add(target_, pose.centre + turn * wall, tolerance_m);
  }
  Tally of_target;
  for (const Eigen::Vector2d& wall : target_walls_) {
    of_target.Add(source_, source_.centre() + back * (wall - pose.centre), tolerance_m);
  }
  const double agrees_m = of_source.agrees * source_wall_m_ + of_target.agrees * target_wall_m_;
  const double contradicts_m =
      of_source.contradicts * source_wall_m_ + of_target.contradicts * target_wall_m_;
  const double smaller_m = std::min(source_.length_m(), target_.length_m());
  WallAgreement agreement;
  agreement.score = std::min(1.0, (agrees_m - contradicts_m) / (2.0 * smaller_m));
  agreement.inlier_share = agrees_m > 0.0 ? agrees_m / (agrees_m + contradicts_m) : 0.0;
  return agreement;
}

Eigen::Matrix3d WallAlignment::InformationAt(const PlanarTransform& pose) const {
  return NormalAt(PoseOf(pose), kKernelOfCovariance_m).information;
}

double WallAlignment::Distance(const PlanarTransform& a, const PlanarTransform& b) const {
  const double lever_m = 2.0 * std::sin(0.5 * (a.yaw() - b.yaw())) * source_.spread_m();
  return std::hypot((PoseOf(a).centre - PoseOf(b).centre).norm(), lever_m);
}

}  // namespace hypermap::registration
