#include "map/fusion/evidence_merge.h"

#include "map/fusion/evidence_overlap.h"
#include "map/fusion/widened_polygon.h"

namespace hypermap::fusion {
namespace {

// Returns whether the frame detected the two tracks separately, with the same class.
bool DetectedSeparately(const std::vector<FrameDetection>& detections, const FrameTrack& a,
                        const FrameTrack& b) {
  if (!a.detection || !b.detection || *a.detection == *b.detection) return false;
  return detections[*a.detection].label == detections[*b.detection].label;
}

// Returns whether the overlap of their widened outlines shows the two to be one thing.
bool OverlapAsOne(const Track& a, const Track& b, const OutlineOverlap& overlap,
                  const EvidenceParameters& parameters) {
  if (overlap.iou > parameters.merge_any_class_iou) return true;
  if (a.label() != b.label()) return false;
  if (overlap.iou > parameters.merge_iou || overlap.contained > parameters.merge_containment) {
    return true;
  }
  // Never side by side in enough detections: parts of one thing.
  return !a.apart.count(b.key) && a.hits + b.hits >= parameters.merge_parts_hits &&
         (overlap.iou > parameters.merge_parts_iou ||
          overlap.contained > parameters.merge_parts_containment);
}

}  // namespace

void CountApart(const std::vector<FrameDetection>& detections, const EvidenceParameters& parameters,
                std::vector<FrameTrack>* tracks) {
  for (FrameTrack& a : *tracks) {
    if (!a.detection) continue;
    const Box& bounds = detections[*a.detection].hull.bounds();
    for (const FrameTrack& b : *tracks) {
      if (!DetectedSeparately(detections, a, b)) continue;
      const Point middle = Centroid(detections[*b.detection].hull);
      if (Distance(bounds, middle) <= parameters.side_by_side_m) ++a.track->apart[b.track->key];
    }
  }
}

std::vector<std::pair<TrackKey, TrackKey>> MergeTracks(
    const std::vector<FrameDetection>& detections, double buffer_m,
    const EvidenceParameters& parameters, std::vector<FrameTrack>* tracks) {
  std::vector<std::pair<TrackKey, TrackKey>> merged;
  const double margin_m = parameters.merge_buffer_share * buffer_m;
  for (FrameTrack& a : *tracks) {
    if (!a.track || !a.hit || a.track->outline.empty()) continue;
    Polygon wide_a;  // Computed when it is first needed.
    for (FrameTrack& b : *tracks) {
      if (&a == &b || !b.track || b.track->outline.empty()) continue;
      if (!a.track->outline.bounds().Intersects(b.track->outline.bounds())) continue;
      if (HeightOverlap(a.track->height(), b.track->height(), parameters.min_height_range_m) <
          parameters.height_overlap) {
        continue;
      }
      if (a.track->IsApartFrom(*b.track) || DetectedSeparately(detections, a, b)) continue;
      if (wide_a.empty()) wide_a = Widened(a.track->outline, margin_m);
      const OutlineOverlap overlap = OverlapOf(wide_a, Widened(b.track->outline, margin_m));
      if (!OverlapAsOne(*a.track, *b.track, overlap, parameters)) continue;
      FrameTrack& from = a.track->hits > b.track->hits ? b : a;
      FrameTrack& into = a.track->hits > b.track->hits ? a : b;
      merged.emplace_back(from.track->key, into.track->key);
      into.track->Absorb(*from.track, parameters);
      into.track->Refresh(parameters);
      into.hit = true;
      from.track = nullptr;
      wide_a = {};
      if (&from == &a) break;
    }
  }
  return merged;
}

}  // namespace hypermap::fusion
