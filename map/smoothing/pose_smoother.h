// Poses of observations, improved by what the observations have in common.
#ifndef HYPERMAP_MAP_SMOOTHING_POSE_SMOOTHER_H_
#define HYPERMAP_MAP_SMOOTHING_POSE_SMOOTHER_H_

#include <Eigen/Core>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/observations/pose_correction.h"
#include "map/smoothing/depth_scan.h"
#include "map/smoothing/grid_walls.h"

namespace hypermap::smoothing {

// What the smoother keeps of an observation.
struct View {
  std::string robot;
  CorrectedPose claim;  // In the frame of all views.
  DepthScan scan;
};

// A claim with smaller standard deviations than these is not improved: it is from something better
// than a localisation, such as motion capture or a map that was closed offline.
inline constexpr double kExactSigma_m = 0.01;
inline constexpr double kExactSigma_rad = 0.005;
bool IsExact(const CorrectedPose& claim);

// Estimates the trajectories of all robots together: successive frames, and frames that see the
// same surfaces at other times or from other robots, are matched to each other, and surfaces to the
// walls of a grid, if there is one (`walls` may be null). The errors of claims are taken to be
// correlated over seconds, which is why averaging them needs the motions (Gauss-Markov bias; sparse
// Gauss-Newton). Deterministic. `views` are ordered by robot, then by stamp, no two of a robot with
// one stamp. Returns a pose for each view; the claim itself for an exact one, and for one that
// nothing ties to others. Costs about 5 ms a view. CANCELLED if the work of this thread
// is cancelled.
absl::StatusOr<std::vector<CorrectedPose>> SmoothPoses(const std::vector<View>& views,
                                                       const GridWalls* walls);

}  // namespace hypermap::smoothing

#endif  // HYPERMAP_MAP_SMOOTHING_POSE_SMOOTHER_H_
