// What a fold of the evidence strategy did with an observation, so that it need not be computed
// again when an earlier observation arrives late.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_STEP_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_STEP_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "map/fusion/evidence_parameters.h"
#include "map/fusion/evidence_state.h"
#include "map/fusion/repeated_view.h"
#include "map/fusion/strategy.h"
#include "map/fusion/track.h"
#include "map/geometry/point.h"

namespace hypermap::fusion {

// The result of an observation depends on the tracks near it, on whether it repeats another
// robot's view, and on the ranks of its scores. Ranks depend on all observations before it, but
// change nothing but the log-odds of tracks; and log-odds have an influence on two decisions only:
// which tracks are references of the alignment, and which are forgotten. So a step can be repeated
// on each state that has the same tracks near it but for their log-odds, if these lead to the same
// decisions: the log-odds are computed again, by the same operations.
class EvidenceStep : public FoldStep {
 public:
  // A track near the observation, or one that it founded.
  struct Affected {
    TrackPtr before;              // null if it was founded
    TrackPtr after;               // null if it is gone; the same as `before` if nothing has changed
    std::optional<double> score;  // of the detection that hit it
    std::optional<double> loss;   // of log-odds, by a miss
  };

  // Those in `box` (BoxInView), in the order of the state, then those founded.
  std::vector<Affected> tracks;
  size_t num_founded = 0;
  // Tracks that were merged into others, as indices (from, into), in that order.
  std::vector<std::pair<size_t, size_t>> merged;
  Box box;
  View view;
  std::vector<double> scores;  // of the detections that were ranked

  int64_t bytes() const override;
};

// Returns the state after the step's observation: what FoldEvidence returns, to the last bit. Null
// if the step can't be repeated on this state. REQUIRES: the observation repeats no other view.
std::shared_ptr<const EvidenceState> Repeated(const EvidenceStep& step, const EvidenceState& before,
                                              const EvidenceParameters& parameters);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_STEP_H_
