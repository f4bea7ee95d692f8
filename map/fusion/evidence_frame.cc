#include "map/fusion/evidence_frame.h"

#include <utility>

#include "map/geometry/convex_hull.h"

namespace hypermap::fusion {
namespace {

// Detections farther than this from the frame's origin are left out: the rows and columns of their
// cells would exceed the range of ShapeGrid.
constexpr double kFarthest_m = 5e6;
// Tracks this close to the view are included, because alignment may move detections onto them; it
// moves at most 45 cm along an axis (alignment.cc).
constexpr double kViewMargin_m = 0.5;

std::string BestLabel(const Detection& detection, double* score) {
  std::string best;
  *score = 0.0;
  for (const auto& [label, value] : detection.scores) {
    if (value > *score) {
      best = label;
      *score = value;
    }
  }
  return best;
}

}  // namespace

std::vector<FrameDetection> CollectDetections(const Observation& observation) {
  std::vector<FrameDetection> collected;
  for (size_t i = 0; i < observation.detections.size(); ++i) {
    const Detection& detection = observation.detections[i];
    const Polygon& hull = detection.hull;
    const Box origin{{0.0, 0.0}, {0.0, 0.0}};
    if (hull.empty() || Distance(origin, hull.bounds().min) > kFarthest_m ||
        Distance(origin, hull.bounds().max) > kFarthest_m) {
      continue;
    }
    FrameDetection added;
    added.detection = &detection;
    added.index = static_cast<int>(i);
    added.label = BestLabel(detection, &added.score);
    added.hull = IsConvex(hull) ? hull : ConvexHull(hull.outer());
    collected.push_back(std::move(added));
  }
  return collected;
}

Box BoxInView(const Observation& observation) {
  Box box = observation.view_hull.bounds();
  for (const Detection& detection : observation.detections) box.Extend(detection.hull.bounds());
  if (box.empty()) return box;
  box.Extend(Point{box.min.x - kViewMargin_m, box.min.y - kViewMargin_m});
  box.Extend(Point{box.max.x + kViewMargin_m, box.max.y + kViewMargin_m});
  return box;
}

std::vector<FrameTrack> CopyTracksIn(const Box& box, const EvidenceState& state) {
  std::vector<FrameTrack> copies;
  for (const TrackList::Position& position : state.tracks.Intersecting(box)) {
    FrameTrack& copy = copies.emplace_back();
    copy.index = position;
    copy.track = CopyToChange(*state.tracks.At(position));
  }
  return copies;
}

}  // namespace hypermap::fusion
