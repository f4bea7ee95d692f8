#include "map/fusion/evidence_align.h"

#include <utility>

#include "map/fusion/alignment.h"
#include "map/fusion/widened_polygon.h"
#include "map/geometry/overlap.h"

namespace hypermap::fusion {
namespace {

// Alignment compares at most about this many cells of each detection, which bounds the cost of
// large ones.
constexpr size_t kMaxAlignmentCells = 64;
// Widens outlines for alignment: small things that the pose error moved off their track overlap it
// only then. Balances them against neighbours of the same class.
constexpr double kAlignmentMargin_m = 0.08;
// Least IoU of outlines for alignment. Balances wrong neighbours against fewer references.
constexpr double kMinAlignmentIou = 0.25;
// Only tracks that probably exist (62 %) are references: others may be errors of earlier frames.
constexpr double kMinReferenceLogOdds = 0.5;
// Added to the covariance of a pose, since one that claims to be exact has no inverse: standard
// deviations of 1 mm and 0.1 mrad, well below the steps of the search.
constexpr double kAddedPositionVariance_m2 = 1e-6;
constexpr double kAddedYawVariance_rad2 = 1e-8;

// Returns the track that the detection is compared with, or null.
const Track* ReferenceOf(const FrameDetection& detection, const std::vector<FrameTrack>& tracks) {
  const Polygon wide = Widened(detection.hull, kAlignmentMargin_m);
  const Track* best = nullptr;
  double best_iou = kMinAlignmentIou;
  for (const FrameTrack& candidate : tracks) {
    const Track& track = *candidate.track;
    if (!IsReference(track.log_odds) || track.label() != detection.label) continue;
    if (!wide.bounds().Intersects(track.outline.bounds())) continue;
    const double iou = Iou(wide, Widened(track.outline, kAlignmentMargin_m));
    if (iou > best_iou) {
      best_iou = iou;
      best = &track;
    }
  }
  return best;
}

// Returns the centres of every n-th cell of the patch, in the layer's frame.
std::vector<Point> ThinnedCells(const CellPatch& patch) {
  size_t total = 0;
  for (const CellSpan& span : patch.spans) {
    total += static_cast<size_t>(span.col_end - span.col_begin);
  }
  const size_t every = total / kMaxAlignmentCells + 1;
  size_t count = 0;
  std::vector<Point> cells;
  for (const CellSpan& span : patch.spans) {
    const auto length = static_cast<size_t>(span.col_end - span.col_begin);
    const size_t skipped = (every - count % every) % every;
    count += length;
    for (size_t k = skipped; k < length; k += every) {
      const int32_t col = span.col_begin + static_cast<int32_t>(k);
      cells.push_back(patch.frame_from_cells * Point{(col + 0.5) * patch.resolution_m,
                                                     (span.row + 0.5) * patch.resolution_m});
    }
  }
  return cells;
}

Eigen::Isometry3d Moved(const Eigen::Isometry3d& frame_from_camera, const Eigen::Vector3d& motion) {
  Eigen::Isometry3d moved = frame_from_camera;
  moved.linear() =
      Eigen::AngleAxisd(motion.z(), Eigen::Vector3d::UnitZ()) * frame_from_camera.linear();
  moved.translation() += Eigen::Vector3d(motion.x(), motion.y(), 0.0);
  return moved;
}

}  // namespace

bool IsReference(double log_odds) { return !(log_odds < kMinReferenceLogOdds); }

AlignedFrame AlignFrame(const Observation& observation,
                        const std::vector<FrameDetection>& detections,
                        const std::vector<FrameTrack>& tracks,
                        const EvidenceParameters& parameters) {
  const SensorPose& pose = observation.pose;
  AlignedFrame frame;
  frame.stamp = observation.stamp;
  frame.pivot = {pose.frame_from_camera.translation().x(),
                 pose.frame_from_camera.translation().y()};
  std::vector<AlignmentPair> pairs;
  for (const FrameDetection& detection : detections) {
    const Track* reference = ReferenceOf(detection, tracks);
    if (!reference) continue;
    AlignmentPair pair;
    pair.cells = ThinnedCells(detection.detection->cells);
    pair.track = reference;
    pair.weight = detection.detection->weight;
    if (!pair.cells.empty()) pairs.push_back(std::move(pair));
  }
  if (!pairs.empty() && parameters.align_gain > 0.0) {
    Eigen::Matrix3d prior = pose.covariance;
    prior(0, 0) += kAddedPositionVariance_m2;
    prior(1, 1) += kAddedPositionVariance_m2;
    prior(2, 2) += kAddedYawVariance_rad2;
    frame.motion = Align(pairs, frame.pivot, prior, parameters);
  }
  if (observation.depth) {
    frame.depth.emplace(*observation.depth, Moved(pose.frame_from_camera, frame.motion),
                        parameters.margin_m);
  }
  return frame;
}

void MoveDetections(const AlignedFrame& frame, std::vector<FrameDetection>* detections) {
  for (FrameDetection& detection : *detections) {
    Ring ring;
    for (const Point& p : detection.hull.outer()) {
      ring.push_back(Apply(frame.motion, frame.pivot, p));
    }
    detection.hull = Polygon::MakeUnchecked({std::move(ring)});
  }
}

}  // namespace hypermap::fusion
