// Which rigid transform of the plane puts one map over another, and how far that can be trusted.
#ifndef HYPERMAP_MAP_REGISTRATION_TRANSFORM_ESTIMATE_H_
#define HYPERMAP_MAP_REGISTRATION_TRANSFORM_ESTIMATE_H_

#include <Eigen/Core>
#include <optional>

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

struct TransformEstimate {
  Mode best;
  // Of (x, y, yaw) of target_from_source, in metres and radians.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  // Share, in [0, 1], of what can be compared that agrees: of the pairs, of the objects that could
  // have been matched, or of the walls that lie on known cells of the other grid.
  double inlier_share = 0.0;
  // The best transform that is not near `best`; nullopt if there is none.
  std::optional<Mode> runner_up;
  Ambiguity ambiguity = Ambiguity::kNone;
};

// Returns the covariance of (x, y, yaw) of target_from_source, given that of the position of some
// point of the source in the target, and of the yaw. `lever` leads from the source's origin to that
// point, in the axes of the target.
Eigen::Matrix3d CovarianceOfTransform(const Eigen::Matrix3d& of_point,
                                      const Eigen::Vector2d& lever);

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_TRANSFORM_ESTIMATE_H_
