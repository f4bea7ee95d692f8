// Adds operators' facts to the state of the evidence strategy.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_FACTS_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_FACTS_H_

#include <memory>

#include "map/fusion/evidence_parameters.h"
#include "map/fusion/evidence_state.h"
#include "map/fusion/strategy.h"

namespace hypermap::fusion {

// Returns the state after `fact`. The fact applies to the track that it names; failing that, to the
// track that it overlaps with an IoU of at least 0.3 (a track with the fact's label is preferred);
// failing that, to a new track with the fact's key. The track becomes pinned or removed. A removed
// track is not shown but still absorbs detections in its place, until the place is seen to be
// empty.
std::shared_ptr<const EvidenceState> FoldFact(const EvidenceState& before, const OperatorFact& fact,
                                              const EvidenceParameters& parameters);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_FACTS_H_
