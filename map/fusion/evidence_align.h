// The first step of the evidence strategy: aligns a frame with the tracks.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_ALIGN_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_ALIGN_H_

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "absl/time/time.h"
#include "map/fusion/depth_lookup.h"
#include "map/fusion/evidence_frame.h"
#include "map/fusion/evidence_parameters.h"

namespace hypermap::fusion {

// A frame after alignment.
struct AlignedFrame {
  absl::Time stamp;
  // The motion (x, y, yaw about `pivot`, the place below the camera) that aligns the frame with the
  // tracks: see Align and Apply in map/fusion/alignment.h.
  Eigen::Vector3d motion = Eigen::Vector3d::Zero();
  Point pivot;
  // The depth image as seen by the moved camera, if there is one. Refers to the observation.
  std::optional<DepthLookup> depth;
};

// Whether a track with these log-odds is a reference: it probably exists.
bool IsReference(double log_odds);

// Finds the motion for which the cells of the detections agree best with tracks of their class,
// within the covariance of the pose. The reference of a detection is the track with the largest IoU
// among those that probably exist; without references, the motion is zero. Costs the number of
// detections times that of tracks, plus the search (Align), for which the cells of each detection
// are thinned to a bounded number.
AlignedFrame AlignFrame(const Observation& observation,
                        const std::vector<FrameDetection>& detections,
                        const std::vector<FrameTrack>& tracks,
                        const EvidenceParameters& parameters);

// Moves the hulls of the detections by the frame's motion.
void MoveDetections(const AlignedFrame& frame, std::vector<FrameDetection>* detections);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_ALIGN_H_
