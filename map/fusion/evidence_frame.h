// The input of one fold of the evidence strategy: the detections of a frame, and copies of the
// tracks that the frame may affect.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_FRAME_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_FRAME_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "map/fusion/evidence_state.h"
#include "map/fusion/track.h"
#include "map/geometry/polygon.h"
#include "map/observations/observation.h"

namespace hypermap::fusion {

// A detection of the frame.
struct FrameDetection {
  const Detection* detection = nullptr;  // In the observation, which must outlive this.
  int index = 0;                         // In Observation::detections.
  // The class with the highest score, and this score.
  std::string label;
  double score = 0.0;
  Polygon hull;     // Convex. As detected; moved by MoveDetections.
  Polygon widened;  // The hull for association, set by WidenOutlines.
};

// A track near enough to the frame's view to be affected by it.
struct FrameTrack {
  std::optional<TrackList::Position> index;  // In the state before; no value for a new track.
  std::shared_ptr<Track> track;              // A copy; null after it was merged into another.
  Polygon widened;   // The outline for association; empty if no detection is near.
  bool hit = false;  // Whether the frame detected it, or one that was merged into it.
  std::optional<size_t> detection;  // Index of the FrameDetection that hit it, if any.
  // The log-odds that a miss took from it, if it was missed.
  std::optional<double> loss;

  // Whether the frame has changed it. If not, the state keeps the original.
  bool changed() const { return !track || hit || loss; }
};

// Returns the detections in their order, without those so far away that the rows and columns of
// their cells would exceed the range of ShapeGrid, and those without area.
std::vector<FrameDetection> CollectDetections(const Observation& observation);

// The box of the frame's view and its detections, with a margin. Tracks whose outlines have bounds
// that do not intersect it are not affected by the frame. Empty if the frame has neither.
Box BoxInView(const Observation& observation);

// Returns copies of the tracks in this box, in the order of the state. Costs a comparison of boxes
// for each run of tracks of the state, and a copy of each of those returned.
std::vector<FrameTrack> CopyTracksIn(const Box& box, const EvidenceState& state);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_FRAME_H_
