// The third step of the evidence strategy: adds a detection to its track.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_HIT_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_HIT_H_

#include <cstdint>
#include <memory>

#include "map/fusion/evidence_align.h"
#include "map/fusion/evidence_frame.h"
#include "map/fusion/evidence_parameters.h"
#include "map/fusion/score_ranks.h"

namespace hypermap::fusion {

// Returns a new track without evidence, whose key names the detection.
std::shared_ptr<Track> FoundTrack(const Observation& observation, const FrameDetection& detection,
                                  const EvidenceParameters& parameters);

// The log-odds of a track after a detection with this score, which counts by its rank in `ranks`.
double LogOddsAfterHit(double log_odds, double score, const ScoreRanks& ranks,
                       const EvidenceParameters& parameters);

// Adds a detection, whose hull must have been moved, to the evidence of its track. Existence rises
// by the rank of the score in `ranks`, those of all earlier frames. Cells of the hull get the
// detection's weight; other cells of the track get weight against them where the depth image shows
// an empty place or another thing (an inverse sensor model, Thrun et al. 2005, section 9.2). Costs
// the cells of the track's grid, which are at most 400 aside, and a depth lookup at three heights
// for those of them that have evidence outside the hull.
void AddDetection(const FrameDetection& detection, const AlignedFrame& frame,
                  const ScoreRanks& ranks, const EvidenceParameters& parameters, Track* track);

// Bytes by which AddDetection makes a track grow at most, a new one or another.
int64_t MostGrowth(const Detection& detection, const EvidenceParameters& parameters);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_HIT_H_
