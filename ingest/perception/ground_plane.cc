#include "ingest/perception/ground_plane.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace hypermap::ingest {
namespace {

// About this many pixels are used.
constexpr size_t kSamples = 3001;
// Returns nearer than this are parts of the robot, and beyond the other the noise is too large.
constexpr float kNearest_m = 0.3f;
constexpr float kFarthest_m = 6.0f;
// Heights of a camera for which a floor is looked for.
constexpr double kLowest_m = 0.1;
constexpr double kHighest_m = 5.0;
// Residuals of inverse depth beyond which a pixel does not count, 1/m. The first lets the search
// see the floor from the farthest claim; the last is 4 standard deviations of the noise, and leaves
// out what stands 2 cm above the floor 2 m away from a camera at 1 m.
constexpr double kFirstCut = 0.05;
constexpr double kLastCut = 0.008;
constexpr double kCutFactor = 0.7;
// Most rounds. The search takes 20 to 50 of them to come to rest.
constexpr int kRounds = 80;
constexpr double kAtRest = 1e-14;
// Standard deviation of the inverse depth of a pixel, 1/m (depth_noise.h).
constexpr double kNoise = 0.002;
// The floor is seen well enough if at least so many of the samples show it, and the plane is known
// to this standard deviation, radians or shares of the height.
constexpr double kLeastWeight = 60.0;
constexpr double kMaxSigma = 0.003;
// Largest difference between the measured plane and the claimed one.
constexpr double kMaxTilt_rad = 2.0 * M_PI / 180.0;
constexpr double kMaxLift_m = 0.05;
// Steps of a measured plane and of a claimed one, radians and metres.
constexpr double kMeasuredStep = 1.0 / 16384.0;
constexpr double kClaimedTiltStep_rad = M_PI / 180.0;
constexpr double kClaimedHeightStep_m = 0.01;
// Least horizontal part of a unit vector along the optical axis.
constexpr double kLeastHorizontal = 0.5;

// A pixel: its ray (x, y, 1), and its inverse depth.
struct Sample {
  Eigen::Vector3d ray;
  double inverse_m = 0.0;
};

std::vector<Sample> SamplesOf(const DepthImage& depth, const std::vector<Eigen::Vector2f>& rays) {
  // Odd, because an even step would share factors with the width of most images.
  const size_t step = depth.metres.size() / kSamples | 1;
  std::vector<Sample> samples;
  samples.reserve(depth.metres.size() / step + 1);
  for (size_t i = 0; i < depth.metres.size(); i += step) {
    const float z = depth.metres[i];
    if (!(z >= kNearest_m && z <= kFarthest_m) || std::isnan(rays[i].x())) continue;
    samples.push_back({{rays[i].x(), rays[i].y(), 1.0}, 1.0 / z});
  }
  return samples;
}

double RoundedTo(double step, double value) { return std::round(value / step) * step; }

// Rounds the elevation and roll of the optical axis, and the height. REQUIRES: the optical axis is
// not vertical.
GroundPlane Rounded(const GroundPlane& plane, double tilt_step, double height_step) {
  const Eigen::Vector3d& up = plane.up;
  const double elevation = RoundedTo(tilt_step, std::atan2(up.z(), std::hypot(up.x(), up.y())));
  const double roll = RoundedTo(tilt_step, std::atan2(up.x(), -up.y()));
  return {{std::cos(elevation) * std::sin(roll), -std::cos(elevation) * std::cos(roll),
           std::sin(elevation)},
          RoundedTo(height_step, plane.height_m)};
}

// The normal equations of a plane's inverse depth, which is the product of a ray with a vector.
struct Equations {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weight = 0.0;
};

Equations Weighted(const std::vector<Sample>& samples, const Eigen::Vector3d& plane, double cut) {
  Equations equations;
  for (const Sample& sample : samples) {
    const double ratio = (plane.dot(sample.ray) - sample.inverse_m) / cut;
    const double inside = 1.0 - ratio * ratio;
    if (!(inside > 0.0)) continue;
    const double weight = inside * inside;
    equations.information.noalias() += weight * sample.ray * sample.ray.transpose();
    equations.sum += weight * sample.inverse_m * sample.ray;
    equations.weight += weight;
  }
  return equations;
}

bool IsSeenWell(const Equations& equations, double height_m) {
  if (!(equations.weight >= kLeastWeight)) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(equations.information,
                                                              Eigen::EigenvaluesOnly);
  const double least = solver.eigenvalues()(0);
  return least > 0.0 && height_m * kNoise / std::sqrt(least) <= kMaxSigma;
}

}  // namespace

GroundPlane ClaimedGround(const Eigen::Isometry3d& frame_from_camera) {
  return {frame_from_camera.linear().row(2).normalized(), frame_from_camera.translation().z()};
}

std::optional<GroundPlane> MeasuredGround(const DepthImage& depth,
                                          const std::vector<Eigen::Vector2f>& rays,
                                          const GroundPlane& claimed) {
  if (!(claimed.height_m >= kLowest_m && claimed.height_m <= kHighest_m)) return std::nullopt;
  const std::vector<Sample> samples = SamplesOf(depth, rays);
  // Of a point of the plane, up.dot(point) + height == 0, and point == ray * depth.
  Eigen::Vector3d plane = -claimed.up / claimed.height_m;
  Equations equations;
  double cut = kFirstCut;
  for (int round = 0; round < kRounds; ++round) {
    equations = Weighted(samples, plane, cut);
    if (!(equations.weight >= kLeastWeight)) return std::nullopt;
    const Eigen::Vector3d next = equations.information.ldlt().solve(equations.sum);
    const double change = (next - plane).norm() / next.norm();
    // False also if it is not finite.
    if (!(change < 1.0)) return std::nullopt;
    plane = next;
    if (cut > kLastCut) {
      cut = std::max(kLastCut, kCutFactor * cut);
    } else if (change < kAtRest) {
      break;
    }
  }
  const double height_m = 1.0 / plane.norm();
  const GroundPlane found = {-height_m * plane, height_m};
  const double tilt = std::atan2(found.up.cross(claimed.up).norm(), found.up.dot(claimed.up));
  if (!IsSeenWell(equations, height_m) || !(tilt <= kMaxTilt_rad) ||
      !(std::abs(height_m - claimed.height_m) <= kMaxLift_m)) {
    return std::nullopt;
  }
  return Rounded(found, kMeasuredStep, kMeasuredStep);
}

GroundPlane GroundOf(const DepthImage& depth, const std::vector<Eigen::Vector2f>& rays,
                     const GroundPlane& claimed) {
  if (std::hypot(claimed.up.x(), claimed.up.y()) < kLeastHorizontal) return claimed;
  const std::optional<GroundPlane> measured = MeasuredGround(depth, rays, claimed);
  if (measured) return *measured;
  return Rounded(claimed, kClaimedTiltStep_rad, kClaimedHeightStep_m);
}

}  // namespace hypermap::ingest
