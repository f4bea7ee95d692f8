// What the evidence strategy knows.
#ifndef HYPERMAP_INGEST_FUSION_EVIDENCE_STATE_H_
#define HYPERMAP_INGEST_FUSION_EVIDENCE_STATE_H_

#include <vector>

#include "ingest/fusion/score_ranks.h"
#include "ingest/fusion/strategy.h"
#include "ingest/fusion/track.h"

namespace hypermap::fusion {

class EvidenceState : public State {
 public:
  // In the order of their founding.
  std::vector<TrackPtr> tracks;
  ScoreRanks ranks;
};

}  // namespace hypermap::fusion

#endif  // HYPERMAP_INGEST_FUSION_EVIDENCE_STATE_H_
