#include "map/registration/grid_estimate.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "map/registration/copy_refinement.h"
#include "map/registration/pose_search.h"
#include "map/registration/wall_alignment.h"
#include "map/registration/wall_map.h"

namespace hypermap::registration {
namespace {

// Poses of the search that are refined with few walls, and of them those that are refined again
// with many.
constexpr int kCandidates = 200;
constexpr size_t kFinalists = 12;
// Finalists of the best one's mode, so that there is room for runners-up.
constexpr size_t kMostNearBest = 5;
constexpr size_t kFewWalls = 600;
constexpr size_t kManyWalls = 8000;
// Widths of the robust kernel at which walls are first drawn to each other, and those at the end.
constexpr double kWideKernel_m = 0.5;
constexpr double kNarrowKernel_m = 0.1;
// Poses whose walls are nearer to each other than this have become the same,
constexpr double kSamePose_m = 0.05;
// and those whose walls are nearer than this are one mode.
constexpr double kSameMode_m = 0.4;
// An estimate is ambiguous unless its score and its inlier share are at least these,
constexpr double kLeastScore = 0.5;
constexpr double kLeastShareOfWalls = 0.85;
// the score of the runner-up is at most this share of the best one's,
constexpr double kMostOfSecondWalls = 0.7;
// and the walls' standard deviation is at most this in each direction.
constexpr double kMostSigma_m = 0.1;

// Images and poses of the search, at most.
constexpr int64_t kBytesOfSearch = 16 << 20;

// Of the source's centre and yaw, in 1 / m^2 and 1 / rad^2.
constexpr double kLeastInformation = 1e-6;

struct Judged {
  PlanarTransform pose;
  WallAgreement agreement;
};

// Returns the poses refined and judged by `alignment`, best first.
absl::StatusOr<std::vector<Judged>> Judge(const WallAlignment& alignment,
                                          const std::vector<PlanarTransform>& poses,
                                          double kernel_m) {
  std::vector<Judged> judged;
  for (const PlanarTransform& pose : poses) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const PlanarTransform refined = alignment.Refined(pose, kernel_m, kNarrowKernel_m);
    judged.push_back({refined, alignment.AgreementAt(refined)});
  }
  std::stable_sort(judged.begin(), judged.end(), [](const Judged& a, const Judged& b) {
    return a.agreement.score > b.agreement.score;
  });
  return judged;
}

// Returns the poses of the search that are distinct once they are refined, best first.
absl::StatusOr<std::vector<PlanarTransform>> Finalists(const WallMap& source,
                                                       const WallMap& target) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Mode> found,
                            SearchPoses(source, target, kCandidates));
  std::vector<PlanarTransform> poses;
  poses.reserve(found.size());
  for (const Mode& mode : found) poses.push_back(mode.target_from_source);
  const WallAlignment alignment(source, target, kFewWalls);
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Judged> judged,
                            Judge(alignment, poses, kWideKernel_m));
  std::vector<PlanarTransform> finalists;
  size_t near_best = 0;
  for (const Judged& candidate : judged) {
    if (finalists.size() == kFinalists) break;
    const auto is_within = [&](const PlanarTransform& pose, double distance_m) {
      return alignment.Distance(pose, candidate.pose) < distance_m;
    };
    const bool is_known =
        std::any_of(finalists.begin(), finalists.end(),
                    [&](const PlanarTransform& pose) { return is_within(pose, kSamePose_m); });
    if (is_known) continue;
    if (!finalists.empty() && is_within(finalists[0], kSameMode_m)) {
      if (near_best == kMostNearBest) continue;
      ++near_best;
    }
    finalists.push_back(candidate.pose);
  }
  return finalists;
}

// Returns the covariance of the motion of the source's centre at a pose.
Eigen::Matrix3d CovarianceOfCentre(const WallAlignment& alignment, const PlanarTransform& pose) {
  // Where nothing holds the pose, the variance is large, but finite.
  const Eigen::Matrix3d information =
      alignment.InformationAt(pose) + kLeastInformation * Eigen::Matrix3d::Identity();
  return information.inverse();
}

// Returns the standard deviation of the walls in the direction in which it is largest.
double LargestSigma(const Eigen::Matrix3d& of_centre, double spread_m) {
  const Eigen::Vector3d scale(1.0, 1.0, spread_m);
  const Eigen::Matrix3d of_walls = scale.asDiagonal() * of_centre * scale.asDiagonal();
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(of_walls).eigenvalues().maxCoeff());
}

Ambiguity AmbiguityOf(const TransformEstimate& estimate, double sigma_m) {
  if (estimate.best.score < kLeastScore || estimate.inlier_share < kLeastShareOfWalls) {
    return Ambiguity::kLittleAgreement;
  }
  if (estimate.runner_up && estimate.runner_up->score > kMostOfSecondWalls * estimate.best.score) {
    return Ambiguity::kRunnerUp;
  }
  return sigma_m > kMostSigma_m ? Ambiguity::kFreeDirection : Ambiguity::kNone;
}

}  // namespace

absl::StatusOr<TransformEstimate> EstimateFromGrids(const GridLayer& source_grid,
                                                    const GridLayer& target_grid) {
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesOfSearch));
  HYPERMAP_ASSIGN_OR_RETURN(const WallMap source, WallMap::Make(source_grid, "source"));
  HYPERMAP_ASSIGN_OR_RETURN(const WallMap target, WallMap::Make(target_grid, "target"));
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<PlanarTransform> finalists,
                            Finalists(source, target));
  const WallAlignment alignment(source, target, kManyWalls);
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Judged> judged,
                            Judge(alignment, finalists, kNarrowKernel_m));
  TransformEstimate estimate;
  if (judged.empty()) {
    estimate.ambiguity = Ambiguity::kLittleAgreement;
    return estimate;
  }
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform pose,
                            RefinedAsCopy(source, target, judged.front().pose));
  estimate.best = {pose, judged.front().agreement.score};
  estimate.inlier_share = judged.front().agreement.inlier_share;
  const auto runner_up = std::find_if(judged.begin(), judged.end(), [&](const Judged& other) {
    return alignment.Distance(pose, other.pose) > kSameMode_m;
  });
  if (runner_up != judged.end()) {
    estimate.runner_up = Mode{runner_up->pose, runner_up->agreement.score};
  }
  const Eigen::Matrix3d of_centre = CovarianceOfCentre(alignment, pose);
  estimate.covariance =
      CovarianceOfTransform(of_centre, Eigen::Rotation2Dd(pose.yaw()) * source.centre());
  estimate.ambiguity = AmbiguityOf(estimate, LargestSigma(of_centre, source.spread_m()));
  return estimate;
}

}  // namespace hypermap::registration
