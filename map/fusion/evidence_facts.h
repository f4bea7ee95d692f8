// What operators say, in the evidence strategy's state.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_FACTS_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_FACTS_H_

#include <memory>

#include "map/fusion/evidence_parameters.h"
#include "map/fusion/evidence_state.h"
#include "map/fusion/strategy.h"

namespace hypermap::fusion {

// The track that the fact names, else the one it lies on (IoU of at least 0.3, the same label
// before others), else a new one with the fact's key: pinned, or removed. A removed track goes on
// taking in what is detected in its place, unseen, until the place is seen to be empty.
std::shared_ptr<const EvidenceState> FoldFact(const EvidenceState& before, const OperatorFact& fact,
                                              const EvidenceParameters& parameters);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_FACTS_H_
