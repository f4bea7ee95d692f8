#include "map/registration/point_pairs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/registration/consensus.h"

namespace hypermap::registration {
namespace {

// A pair agrees with a transform up to this many of its standard deviations: all but 1 % of the
// right ones do.
constexpr double kPairSigmas = 3.0;
// An estimate is ambiguous unless more than this share of the pairs agree,
constexpr double kLeastShareOfPairs = 0.5;
// the score of the runner-up is at most this share of the best one's,
constexpr double kMostOfSecondPairs = 0.7;
// and the standard deviation of the yaw is at most this.
constexpr double kMostYawSigma_rad = 0.1;

Eigen::Vector2d Vector(const Point& p) { return {p.x, p.y}; }

double Weight(const PointPair& pair) { return 1.0 / (pair.sigma_m * pair.sigma_m); }

absl::Status CheckPairs(absl::Span<const PointPair> pairs) {
  if (pairs.size() < 2) return absl::FailedPreconditionError("a transform needs two pairs");
  if (pairs.size() > kMaxPointPairs) {
    return absl::ResourceExhaustedError(
        absl::StrCat("pairs has ", pairs.size(), " elements, more than ", kMaxPointPairs));
  }
  for (size_t i = 0; i < pairs.size(); ++i) {
    const PointPair& pair = pairs[i];
    if (!IsFinite(pair.source) || !IsFinite(pair.target)) {
      return absl::InvalidArgumentError(absl::StrCat("pairs[", i, "] is not finite"));
    }
    if (!(pair.sigma_m > 0.0) || !std::isfinite(pair.sigma_m)) {
      return absl::InvalidArgumentError(
          absl::StrCat("pairs[", i, "].sigma_m is ", pair.sigma_m, ", but must be positive"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

RigidFit FitPairs(absl::Span<const PointPair> pairs) {
  // Relative to the first pair, so that means do not round far from the origin.
  const Eigen::Vector2d source_base = Vector(pairs[0].source);
  const Eigen::Vector2d target_base = Vector(pairs[0].target);
  double weights = 0.0;
  Eigen::Vector2d source_mean = Eigen::Vector2d::Zero();
  Eigen::Vector2d target_mean = Eigen::Vector2d::Zero();
  for (const PointPair& pair : pairs) {
    weights += Weight(pair);
    source_mean += Weight(pair) * (Vector(pair.source) - source_base);
    target_mean += Weight(pair) * (Vector(pair.target) - target_base);
  }
  source_mean = source_base + source_mean / weights;
  target_mean = target_base + target_mean / weights;
  double dot = 0.0;
  double cross = 0.0;
  double inertia = 0.0;
  for (const PointPair& pair : pairs) {
    const Eigen::Vector2d s = Vector(pair.source) - source_mean;
    const Eigen::Vector2d t = Vector(pair.target) - target_mean;
    dot += Weight(pair) * s.dot(t);
    cross += Weight(pair) * (s.x() * t.y() - s.y() * t.x());
    inertia += Weight(pair) * s.squaredNorm();
  }
  const double yaw = std::atan2(cross, dot);
  const Eigen::Rotation2Dd turn(yaw);
  const Eigen::Vector2d lever = turn * source_mean;
  RigidFit fit;
  fit.target_from_source =
      PlanarTransform(target_mean.x() - lever.x(), target_mean.y() - lever.y(), yaw);
  for (const PointPair& pair : pairs) {
    const Eigen::Vector2d residual =
        (Vector(pair.target) - target_mean) - turn * (Vector(pair.source) - source_mean);
    fit.chi_squared += Weight(pair) * residual.squaredNorm();
  }
  const double freedom = 2.0 * static_cast<double>(pairs.size()) - 3.0;
  const double scale = std::max(1.0, fit.chi_squared / freedom);
  const Eigen::Vector3d of_mean(1.0 / weights, 1.0 / weights, 1.0 / inertia);
  fit.covariance = CovarianceOfTransform(scale * of_mean.asDiagonal().toDenseMatrix(), lever);
  return fit;
}

absl::StatusOr<TransformEstimate> EstimateFromPairs(absl::Span<const PointPair> pairs) {
  HYPERMAP_RETURN_IF_ERROR(CheckPairs(pairs));
  std::vector<Correspondence> correspondences;
  for (size_t i = 0; i < pairs.size(); ++i) {
    const int index = static_cast<int>(i);
    correspondences.push_back({index, index, kPairSigmas * pairs[i].sigma_m, pairs[i]});
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Consensus> found, FindConsensus(correspondences));
  TransformEstimate estimate = EstimateOf(found, pairs.size());
  const double yaw_variance = estimate.covariance(2, 2);
  if (found.empty() || estimate.inlier_share <= kLeastShareOfPairs) {
    estimate.ambiguity = Ambiguity::kLittleAgreement;
  } else if (estimate.runner_up &&
             estimate.runner_up->score > kMostOfSecondPairs * estimate.best.score) {
    estimate.ambiguity = Ambiguity::kRunnerUp;
  } else if (!(yaw_variance <= kMostYawSigma_rad * kMostYawSigma_rad)) {
    estimate.ambiguity = Ambiguity::kFreeDirection;
  }
  return estimate;
}

}  // namespace hypermap::registration
