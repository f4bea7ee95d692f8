#include "map/smoothing/scan_matcher.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace hypermap::smoothing {
namespace {

constexpr int kMaxRounds = 20;
constexpr double kLeastGate_m = 0.06;
constexpr double kNarrowing = 0.75;  // Of the gate, each round.
// Points that must agree, and their share of those that could.
constexpr int kMinPoints = 25;
constexpr double kMinShare = 0.5;
// Surfaces are the same if their normals are within 45 degrees.
constexpr double kMinCosine = 0.7;
// Neighbouring pixels share errors, so that together they tell less than as many measurements.
constexpr double kIndependentShare = 0.3;
// Residuals beyond this many standard deviations count little.
constexpr double kKernel = 3.0;
// Standard deviations of what limits a match besides noise, such as the thinning of the image.
constexpr double kLeastSigma_m = 0.001;
constexpr double kLeastSigma_rad = 0.0005;
// Points for an overlap, and how near they must be.
constexpr size_t kOverlapPoints = 40;
constexpr float kOverlapReach_m = 0.3f;

// Sums of one round of Gauss-Newton.
struct Sums {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  int visible = 0;
  int agreeing = 0;

  // Adds the distance along `direction` (of length 1) of a point that is at `turned` from the
  // second camera, in the axes of the first.
  void Add(double distance, const Eigen::Vector2d& direction, const Eigen::Vector2d& turned,
           double variance, double gate_m) {
    const double scale2 = std::max(kKernel * kKernel * variance, 0.25 * gate_m * gate_m);
    const double ratio2 = distance * distance / scale2;
    if (ratio2 < 1.0) ++agreeing;
    const double weight = GemanMcClure(ratio2) / variance;
    const Eigen::Vector3d jacobian(direction.x(), direction.y(),
                                   direction.dot(Perpendicular(turned)));
    information += weight * jacobian * jacobian.transpose();
    gradient += weight * distance * jacobian;
  }
};

// A point of the second view as it is placed in the first one.
struct Placed {
  Eigen::Vector2d turned;
  Eigen::Vector3f position;
};

Placed Place(const PlanarPose& motion, const Turn& turn, const Eigen::Vector3f& position) {
  const Eigen::Vector2d turned = turn * position.head<2>().cast<double>();
  const Eigen::Vector2d moved = turned + motion.head<2>();
  return {turned, {static_cast<float>(moved.x()), static_cast<float>(moved.y()), position.z()}};
}

double Variance(float a, float b) {
  return static_cast<double>(a) * a + static_cast<double>(b) * b;
}

void AddSurface(const DepthScan& first, const DepthScan& second, const PlanarPose& motion,
                double gate_m, Sums* sums) {
  const Turn turn(motion.z());
  for (const SurfacePoint& point : second.surface()) {
    const Placed placed = Place(motion, turn, point.position);
    const SurfacePoint* const other = first.SurfaceAt(placed.position);
    if (other == nullptr) continue;
    ++sums->visible;
    const Eigen::Vector2d normal = other->normal.cast<double>();
    if (normal.dot(turn * point.normal.cast<double>()) < kMinCosine) continue;
    const Eigen::Vector2d apart = (placed.position - other->position).head<2>().cast<double>();
    if (apart.squaredNorm() > 4.0 * gate_m * gate_m + 0.02) continue;
    sums->Add(normal.dot(apart), normal, placed.turned, Variance(point.sigma_m, other->sigma_m),
              gate_m);
  }
}

void AddEdges(const DepthScan& first, const DepthScan& second, const PlanarPose& motion,
              double gate_m, Sums* sums) {
  const Turn turn(motion.z());
  for (const EdgePoint& edge : second.edges()) {
    const Placed placed = Place(motion, turn, edge.position);
    const EdgePoint* const other = first.EdgeNear(placed.position, edge.is_right);
    if (other == nullptr) continue;
    const Eigen::Vector2d apart = (placed.position - other->position).head<2>().cast<double>();
    if (apart.norm() > gate_m + 0.1) continue;
    const Eigen::Vector2d across =
        Perpendicular(other->position.head<2>().cast<double>().normalized());
    sums->Add(across.dot(apart), across, placed.turned, Variance(edge.sigma_m, other->sigma_m),
              gate_m);
  }
}

}  // namespace

std::optional<ScanMatch> Match(const DepthScan& first, const DepthScan& second,
                               const PlanarPose& guess, double gate_m) {
  PlanarPose motion = guess;
  Sums sums;
  // Where no surface tells the motion, it stays.
  const Eigen::Matrix3d damping = Eigen::Vector3d(100.0, 100.0, 1000.0).asDiagonal();
  for (int round = 0; round < kMaxRounds; ++round) {
    const double gate = std::max(kLeastGate_m, gate_m * std::pow(kNarrowing, round));
    sums = Sums();
    AddSurface(first, second, motion, gate, &sums);
    const int on_surface = sums.agreeing;
    AddEdges(first, second, motion, gate, &sums);
    if (sums.agreeing < kMinPoints || on_surface < kMinShare * sums.visible) return std::nullopt;
    const Eigen::Vector3d step = (kIndependentShare * sums.information + damping)
                                     .ldlt()
                                     .solve(kIndependentShare * sums.gradient);
    motion -= step;
    if (gate == kLeastGate_m && step.head<2>().norm() < 1e-4 && std::abs(step.z()) < 1e-5) break;
  }
  if (!motion.allFinite()) return std::nullopt;
  Eigen::Matrix3d covariance = (kIndependentShare * sums.information + 0.01 * damping).inverse();
  covariance.diagonal() +=
      Eigen::Vector3d(kLeastSigma_m, kLeastSigma_m, kLeastSigma_rad).cwiseAbs2();
  return ScanMatch{{motion.x(), motion.y(), Wrapped(motion.z())}, covariance.inverse()};
}

double Overlap(const DepthScan& first, const DepthScan& second, const PlanarPose& motion) {
  const std::vector<SurfacePoint>& points = second.surface();
  if (points.empty()) return 0.0;
  const Turn turn(motion.z());
  const size_t step = std::max<size_t>(1, points.size() / kOverlapPoints);
  int seen = 0;
  int all = 0;
  for (size_t i = 0; i < points.size(); i += step) {
    ++all;
    const Placed placed = Place(motion, turn, points[i].position);
    const SurfacePoint* const other = first.SurfaceAt(placed.position);
    if (other != nullptr && (other->position - placed.position).norm() < kOverlapReach_m) ++seen;
  }
  return static_cast<double>(seen) / all;
}

}  // namespace hypermap::smoothing
