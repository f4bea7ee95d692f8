// One step of the evidence strategy.
#ifndef HYPERMAP_INGEST_FUSION_EVIDENCE_FOLD_H_
#define HYPERMAP_INGEST_FUSION_EVIDENCE_FOLD_H_

#include "ingest/fusion/evidence_parameters.h"
#include "ingest/fusion/evidence_state.h"
#include "ingest/fusion/strategy.h"
#include "map/observations/observation.h"

namespace hypermap::fusion {

// The state after `observation`. `report` may be null.
std::shared_ptr<const EvidenceState> FoldEvidence(const EvidenceState& before,
                                                  const Observation& observation,
                                                  const EvidenceParameters& parameters,
                                                  FoldReport* report);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_INGEST_FUSION_EVIDENCE_FOLD_H_
