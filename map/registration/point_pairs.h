// The rigid transform between points whose pairs are known.
#ifndef HYPERMAP_MAP_REGISTRATION_POINT_PAIRS_H_
#define HYPERMAP_MAP_REGISTRATION_POINT_PAIRS_H_

#include <Eigen/Core>
#include <string>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/point.h"
#include "map/registration/transform_estimate.h"

namespace hypermap::registration {

// Pairs that an estimate may have. The time of an estimate grows with the square up to some
// thousand pairs.
inline constexpr int kMaxPointPairs = 1000;

// The same place in two frames.
struct PointPair {
  Point source;
  Point target;
  // Standard deviation of the distance between them along each axis, in metres; > 0.
  double sigma_m = 0.05;
};

// A pair that people know by a name, such as that of the corner of a room.
struct NamedPair {
  std::string name;  // or empty
  PointPair pair;
};

struct RigidFit {
  PlanarTransform target_from_source;
  // Of (x, y, yaw) of target_from_source, in metres and radians. Scaled up if the residuals are
  // larger than their standard deviations promise.
  Eigen::Matrix3d covariance;
  // Sum of the squared residuals in units of their standard deviations; 2 n - 3 on average for n
  // pairs.
  double chi_squared = 0.0;
};

// Returns the transform with the least sum of squared residuals, weighted by 1 / sigma^2: the
// closed form of Umeyama ("Least-squares estimation of transformation parameters between two point
// patterns", PAMI 1991) in the plane, without scale. REQUIRES: at least two pairs. If all sources
// or all targets are one point, the yaw is arbitrary, and its variance is infinite or large.
RigidFit FitPairs(absl::Span<const PointPair> pairs);

// Returns the transform that most pairs agree on. A minority of them may be wrong by any distance,
// if the right ones are at least three. `runner_up` is the transform on which the most other pairs
// agree. FAILED_PRECONDITION for fewer than two pairs, RESOURCE_EXHAUSTED for more than
// kMaxPointPairs, INVALID_ARGUMENT for a coordinate that is not finite, or a sigma that is not
// positive; errors of CheckCancelled.
absl::StatusOr<TransformEstimate> EstimateFromPairs(absl::Span<const PointPair> pairs);

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_POINT_PAIRS_H_
