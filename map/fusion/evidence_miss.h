// The fourth step of the evidence strategy: takes existence from a track that the frame should have
// detected and did not.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_MISS_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_MISS_H_

#include <optional>

#include "map/fusion/depth_lookup.h"
#include "map/fusion/evidence_parameters.h"
#include "map/fusion/track.h"

namespace hypermap::fusion {

// Shares in [0, 1] of the volume of a track.
struct TrackVisibility {
  double visible = 0.0;  // It would be visible if the track were there.
  double empty = 0.0;    // It was seen to be empty.
};

// Looks up at most about 12 x 12 places at three heights.
TrackVisibility VisibilityOf(const Track& track, const DepthLookup& depth);

// Subtracts the miss of a track without a detection in this frame from its evidence. Returns
// nullopt, and changes nothing, if the track was mostly occluded or out of view, so that the frame
// says nothing about it. Otherwise returns the loss of log-odds, on which these have no influence:
//   clear * max(ln((1 - clutter) / (1 - detection rate)), empty_loss if the place was empty),
// with the first term at most max_miss_loss: the log-odds of a missed detection (Thrun et al. 2005,
// section 9.2), with the track's own detection rate so far (Laplace's rule of succession). `clear`,
// at most 1, compares the view with the usual one that detected the track. Costs VisibilityOf.
std::optional<double> SubtractMiss(const DepthLookup& depth, const EvidenceParameters& parameters,
                                   Track* track);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_MISS_H_
