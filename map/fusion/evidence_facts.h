// Adds operators' facts to the state of the evidence strategy.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_FACTS_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_FACTS_H_

#include <memory>
#include <utility>
#include <vector>

#include "map/fusion/evidence_parameters.h"
#include "map/fusion/evidence_state.h"
#include "map/fusion/strategy.h"
#include "map/fusion/track_index.h"

namespace hypermap::fusion {

// Folds facts onto a state. A fact applies to the track that it names; failing that, to the track
// that it overlaps with an IoU of at least 0.3 (a track with the fact's label is preferred);
// failing that, to a new track with the fact's key. The track becomes pinned or removed. A removed
// track is not shown but still absorbs detections in its place, until the place is seen to be
// empty.
class EvidenceFacts : public FactFold {
 public:
  EvidenceFacts(const EvidenceState& before, const EvidenceParameters& parameters);

  void Add(const OperatorFact& fact) override;
  StatePtr Finish() override { return std::move(after_); }

 private:
  const EvidenceParameters parameters_;
  std::shared_ptr<EvidenceState> after_;
  std::vector<TrackPtr> tracks_;  // Those of after_.
  TrackIndex index_;              // Finds tracks_ by the areas with which facts are compared.
};

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_FACTS_H_
