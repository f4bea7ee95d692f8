// The state of the evidence strategy.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_STATE_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_STATE_H_

#include "map/fusion/repeated_view.h"
#include "map/fusion/score_ranks.h"
#include "map/fusion/strategy.h"
#include "map/fusion/track_list.h"

namespace hypermap::fusion {

class EvidenceState : public State {
 public:
  // In the order in which they were founded.
  TrackList tracks;
  ScoreRanks ranks;
  RecentViews views;
};

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_STATE_H_
