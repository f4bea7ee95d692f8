// Which rigid transform of the plane puts one map over another, and how far that can be trusted.
#ifndef HYPERMAP_MAP_REGISTRATION_TRANSFORM_ESTIMATE_H_
#define HYPERMAP_MAP_REGISTRATION_TRANSFORM_ESTIMATE_H_

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "absl/strings/string_view.h"
#include "map/frames/planar_transform.h"

namespace hypermap::registration {

// Why an estimate must not be used without a further look.
enum class Ambiguity {
  kNone,
  kLittleAgreement,  // Too little of the smaller side agrees, or too much contradicts.
  kRunnerUp,         // Another transform, which is not near the best one, is about as good.
  kFreeDirection,    // Nothing holds the transform in some direction, as along a corridor.
};

// Returns "none", "little_agreement", "runner_up" or "free_direction".
absl::string_view AmbiguityName(Ambiguity ambiguity);

// A transform, and how well the source agrees with the target under it. The score is at most 1:
// what agrees less what contradicts, as a share of the smaller side.
struct Mode {
  PlanarTransform target_from_source;
  double score = 0.0;
};

// A point or object of the source and the one of the target that is the same under a transform.
struct AgreeingPair {
  // Indexes of the pair of points, or ids of the objects.
  int64_t source = 0;
  int64_t target = 0;
  // Distance between the target's and the transformed source's.
  double residual_m = 0.0;

  friend bool operator==(const AgreeingPair&, const AgreeingPair&) = default;
};

// Returns the covariance of a transform that nothing holds: infinite variances.
inline Eigen::Matrix3d InfiniteCovariance() {
  return Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()).asDiagonal();
}

// The identity with score 0 if nothing agrees under any transform.
struct TransformEstimate {
  Mode best;
  // Of (x, y, yaw) of target_from_source, in metres and radians. Has elements that are not finite
  // if nothing holds the yaw, or nothing agrees.
  Eigen::Matrix3d covariance = InfiniteCovariance();
  // Share, in [0, 1], of what can be compared that agrees: of the pairs, of the objects that could
  // have been matched, or of the walls that lie on known cells of the other grid.
  double inlier_share = 0.0;
  // The best transform that is not near `best`; nullopt if there is none.
  std::optional<Mode> runner_up;
  Ambiguity ambiguity = Ambiguity::kNone;
  // Sorted by source. Empty for grids.
  std::vector<AgreeingPair> agreeing;
};

// Returns the estimate for coordinates in other frames than those it was made in. The covariance,
// the runner-up and the best transform change, the rest stays.
TransformEstimate InFrames(TransformEstimate estimate,
                           const PlanarTransform& new_target_from_target,
                           const PlanarTransform& new_source_from_source);

// Returns the covariance of (x, y, yaw) of target_from_source, given that of the position of some
// point of the source in the target, and of the yaw. `lever` leads from the source's origin to that
// point, in the axes of the target.
Eigen::Matrix3d CovarianceOfTransform(const Eigen::Matrix3d& of_point,
                                      const Eigen::Vector2d& lever);

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_TRANSFORM_ESTIMATE_H_
