#include "map/fusion/evidence_associate.h"

#include <algorithm>
#include <cmath>

#include "map/fusion/evidence_overlap.h"
#include "map/fusion/widened_polygon.h"
#include "map/matching/assignment.h"

namespace hypermap::fusion {
namespace {

// A class with a smaller share of a track's evidence counts as another class. Balances things whose
// class the detector confuses against neighbours of another class.
constexpr double kMinClassShare = 0.25;
// Factor of a score for another class; for the track's own, it rises with the class's share to 1.
// Balances the class against the overlap.
constexpr double kOtherClassFactor = 0.5;
// Factor of containment where it stands in for IoU: it wins over a poor overlap, not a good one.
constexpr double kContainmentFactor = 0.5;
// Assignment takes integers as costs, so scores are rounded down to a millionth.
constexpr double kCostPerScore = 1e6;

}  // namespace

double AssociationBuffer(const SensorPose& pose, const EvidenceParameters& parameters) {
  const double sigma = std::sqrt(0.5 * (pose.covariance(0, 0) + pose.covariance(1, 1)));
  return std::min(parameters.max_buffer_m, parameters.buffer_m + parameters.buffer_share * sigma);
}

void WidenOutlines(double buffer_m, std::vector<FrameDetection>* detections,
                   std::vector<FrameTrack>* tracks) {
  for (FrameDetection& detection : *detections) {
    detection.widened = Widened(detection.hull, buffer_m);
  }
  for (FrameTrack& track : *tracks) {
    const Box& bounds = track.track->outline.bounds();
    const Box near{{bounds.min.x - buffer_m, bounds.min.y - buffer_m},
                   {bounds.max.x + buffer_m, bounds.max.y + buffer_m}};
    const bool is_near =
        std::any_of(detections->begin(), detections->end(), [&](const FrameDetection& detection) {
          return detection.widened.bounds().Intersects(near);
        });
    if (is_near) track.widened = Widened(track.track->outline, buffer_m);
  }
}

double AssociationScore(const FrameDetection& detection, const FrameTrack& candidate,
                        const EvidenceParameters& parameters) {
  const Track& track = *candidate.track;
  if (!detection.widened.bounds().Intersects(candidate.widened.bounds())) return 0.0;
  if (HeightOverlap(detection.detection->height, track.height(), parameters.min_height_range_m) <
      parameters.height_overlap) {
    return 0.0;
  }
  const OutlineOverlap outlines = OverlapOf(detection.widened, candidate.widened);
  const double share = track.ClassShare(detection.label);
  if (share > kMinClassShare) {
    double overlap = outlines.iou;
    if (outlines.contained > parameters.containment) {
      overlap = std::max(overlap, kContainmentFactor * outlines.contained);
    }
    const double factor = kOtherClassFactor + (1.0 - kOtherClassFactor) * share;
    return overlap >= parameters.gate ? overlap * factor : 0.0;
  }
  return outlines.iou >= parameters.other_class_gate ? kOtherClassFactor * outlines.iou : 0.0;
}

std::vector<std::optional<TrackMatch>> Associate(const std::vector<FrameDetection>& detections,
                                                 const std::vector<FrameTrack>& tracks,
                                                 const EvidenceParameters& parameters) {
  const size_t rows = detections.size();
  std::vector<std::optional<TrackMatch>> matches(rows);
  if (rows == 0) return matches;
  // A column for each track, and a column "new track" for each detection. A pair that fails the
  // gates costs 1, more than the 0 of a new track, so that it is never chosen.
  const size_t columns = tracks.size() + rows;
  std::vector<double> scores(rows * tracks.size(), 0.0);
  std::vector<evaluation::Cost> costs(rows * columns);
  for (size_t r = 0; r < rows; ++r) {
    for (size_t c = 0; c < tracks.size(); ++c) {
      const double score = AssociationScore(detections[r], tracks[c], parameters);
      scores[r * tracks.size() + c] = score;
      costs[r * columns + c].first =
          score > 0.0 ? -static_cast<int64_t>(score * kCostPerScore) : int64_t{1};
    }
  }
  const std::vector<size_t> columns_of = evaluation::CheapestAssignment(rows, columns, costs);
  for (size_t r = 0; r < rows; ++r) {
    const size_t c = columns_of[r];
    if (c >= tracks.size()) continue;
    const double score = scores[r * tracks.size() + c];
    if (score > 0.0) matches[r] = TrackMatch{c, score};
  }
  return matches;
}

}  // namespace hypermap::fusion
