// How a camera has moved between two frames, from the surfaces and edges that both see.
#ifndef HYPERMAP_MAP_SMOOTHING_SCAN_MATCHER_H_
#define HYPERMAP_MAP_SMOOTHING_SCAN_MATCHER_H_

#include <Eigen/Core>
#include <optional>

#include "map/smoothing/depth_scan.h"
#include "map/smoothing/planar_pose.h"

namespace hypermap::smoothing {

struct ScanMatch {
  PlanarPose motion;  // Of the second view in the first one.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
};

// Returns the motion near `guess`: iterative closest points along the normals of surfaces (Chen,
// Medioni 1992) and across the lines of sight at edges. Points are paired by projection into the
// first image, and weighted by a Geman-McClure kernel that narrows from `gate_m` on. nullopt if the
// frames see too little in common, or too much that contradicts.
std::optional<ScanMatch> Match(const DepthScan& first, const DepthScan& second,
                               const PlanarPose& guess, double gate_m);

// Returns the share of the second view's surface that the first one sees too, in [0, 1]: an
// estimate from some points.
double Overlap(const DepthScan& first, const DepthScan& second, const PlanarPose& motion);

}  // namespace hypermap::smoothing

#endif  // HYPERMAP_MAP_SMOOTHING_SCAN_MATCHER_H_
