// Adds one observation to the state of the evidence strategy.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_FOLD_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_FOLD_H_

#include <memory>

#include "map/fusion/evidence_parameters.h"
#include "map/fusion/evidence_state.h"
#include "map/fusion/evidence_step.h"
#include "map/fusion/strategy.h"
#include "map/observations/observation.h"

namespace hypermap::fusion {

// Returns the state after `observation`, which shares the tracks that the observation did not
// affect with `before`. An observation that repeats another robot's view changes nothing. `report`
// and `step` may be null. A step that an earlier fold of the observation gave is repeated if that
// is possible and no report is wanted; otherwise `*step` is set. The steps of a fold are in the
// files evidence_align, evidence_associate, evidence_hit, evidence_miss and evidence_merge.
std::shared_ptr<const EvidenceState> FoldEvidence(
    const EvidenceState& before, const Observation& observation,
    const EvidenceParameters& parameters, FoldReport* report,
    std::shared_ptr<const EvidenceStep>* step = nullptr);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_FOLD_H_
