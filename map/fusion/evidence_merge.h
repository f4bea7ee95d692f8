// The last step of the evidence strategy: merges tracks of one thing.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_MERGE_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_MERGE_H_

#include <utility>
#include <vector>

#include "map/fusion/evidence_frame.h"
#include "map/fusion/evidence_parameters.h"

namespace hypermap::fusion {

// Counts in Track::apart the pairs of tracks that this frame detected side by side, with the same
// class. Must precede MergeTracks, which keeps such pairs. Costs the square of the number of
// tracks.
void CountApart(const std::vector<FrameDetection>& detections, const EvidenceParameters& parameters,
                std::vector<FrameTrack>* tracks);

// Merges tracks that overlap too much to be two things, if one of them was hit, into the one with
// more detections; if both have as many, the hit one is merged into the other. Sets
// FrameTrack::track of the merged ones to null. Outlines are widened by merge_buffer_share of
// `buffer_m`. Returns the keys (from, into) in the order of merging. Compares each hit track with
// all that overlap its bounds.
std::vector<std::pair<TrackKey, TrackKey>> MergeTracks(
    const std::vector<FrameDetection>& detections, double buffer_m,
    const EvidenceParameters& parameters, std::vector<FrameTrack>* tracks);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_MERGE_H_
