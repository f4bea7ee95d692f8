#include "map/fusion/evidence_strategy.h"

#include <algorithm>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "base/status/status_macros.h"
#include "map/fusion/evidence_codec.h"
#include "map/fusion/evidence_facts.h"
#include "map/fusion/evidence_fold.h"
#include "map/fusion/evidence_hit.h"
#include "map/fusion/evidence_parameters.h"
#include "map/fusion/evidence_state.h"

namespace hypermap::fusion {
namespace {

class EvidenceStrategy : public Strategy {
 public:
  explicit EvidenceStrategy(const EvidenceParameters& parameters) : parameters_(parameters) {}

  absl::string_view name() const override { return "evidence"; }
  StatePtr Initial() const override { return std::make_shared<EvidenceState>(); }
  StatePtr Fold(const StatePtr& state, const Observation& observation,
                FoldReport* report) const override {
    return FoldEvidence(static_cast<const EvidenceState&>(*state), observation, parameters_,
                        report);
  }
  std::unique_ptr<FactFold> FoldFacts(const StatePtr& state) const override {
    return std::make_unique<EvidenceFacts>(static_cast<const EvidenceState&>(*state), parameters_);
  }
  std::vector<FusedObject> Objects(const StatePtr& state) const override {
    std::vector<FusedObject> objects;
    for (const TrackPtr& track : static_cast<const EvidenceState&>(*state).tracks) {
      if (track->object) objects.push_back({track->key, track->object});
    }
    std::sort(objects.begin(), objects.end(),
              [](const FusedObject& a, const FusedObject& b) { return a.track < b.track; });
    return objects;
  }
  int64_t ByteSize(const StatePtr& state, const StatePtr& older) const override {
    absl::flat_hash_set<const Track*> shared;
    if (older) {
      for (const TrackPtr& track : static_cast<const EvidenceState&>(*older).tracks) {
        shared.insert(track.get());
      }
    }
    const auto& tracks = static_cast<const EvidenceState&>(*state).tracks;
    const auto& views = static_cast<const EvidenceState&>(*state).views.views();
    auto bytes = static_cast<int64_t>(sizeof(EvidenceState) + tracks.size() * sizeof(TrackPtr) +
                                      views.size() * sizeof(View));
    for (const TrackPtr& track : tracks) {
      if (!shared.contains(track.get())) bytes += fusion::ByteSize(*track);
    }
    return bytes;
  }
  int64_t MostGrowth(const Observation& observation) const override {
    int64_t bytes = sizeof(View);
    for (const Detection& detection : observation.detections) {
      bytes += fusion::MostGrowth(detection, parameters_);
    }
    return bytes;
  }
  std::string Encode(const StatePtr& state) const override {
    return EncodeEvidence(static_cast<const EvidenceState&>(*state));
  }
  absl::StatusOr<StatePtr> Decode(absl::string_view bytes) const override {
    HYPERMAP_ASSIGN_OR_RETURN(auto state, DecodeEvidence(bytes, parameters_));
    return StatePtr(std::move(state));
  }

 private:
  const EvidenceParameters parameters_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Strategy>> MakeEvidenceStrategy(absl::string_view parameters) {
  HYPERMAP_ASSIGN_OR_RETURN(auto parsed, ParseEvidenceParameters(parameters));
  return std::make_unique<EvidenceStrategy>(parsed);
}

}  // namespace hypermap::fusion
