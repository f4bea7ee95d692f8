#include "map/fusion/evidence_strategy.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "base/status/status_macros.h"
#include "map/fusion/evidence_codec.h"
#include "map/fusion/evidence_facts.h"
#include "map/fusion/evidence_fold.h"
#include "map/fusion/evidence_hit.h"
#include "map/fusion/evidence_parameters.h"
#include "map/fusion/evidence_state.h"

namespace hypermap::fusion {
namespace {

bool IsBefore(const FusedObject& a, const FusedObject& b) { return a.track < b.track; }

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
  StatePtr FoldAgain(const StatePtr& state, const Observation& observation,
                     FoldStepPtr* step) const override {
    // Steps are those of this strategy.
    auto own = std::static_pointer_cast<const EvidenceStep>(*step);
    StatePtr after = FoldEvidence(static_cast<const EvidenceState&>(*state), observation,
                                  parameters_, nullptr, &own);
    *step = std::move(own);
    return after;
  }
  std::unique_ptr<FactFold> FoldFacts(const StatePtr& state) const override {
    return std::make_unique<EvidenceFacts>(static_cast<const EvidenceState&>(*state), parameters_);
  }
  std::vector<FusedObject> Objects(const StatePtr& state) const override {
    std::vector<FusedObject> objects;
    static_cast<const EvidenceState&>(*state).tracks.ForEach([&](const TrackPtr& track) {
      if (track->object) objects.push_back({track->key, track->object});
    });
    std::sort(objects.begin(), objects.end(), IsBefore);
    return objects;
  }
  std::optional<std::vector<FusedObject>> ChangedObjects(const StatePtr& before,
                                                         const StatePtr& after) const override {
    const TrackList& was = static_cast<const EvidenceState&>(*before).tracks;
    const TrackList& is = static_cast<const EvidenceState&>(*after).tracks;
    absl::flat_hash_map<absl::string_view, ObjectPtr> objects;  // of `before`, as far as unknown
    was.ForEachBesides(is, [&](const TrackPtr& track) {
      if (track->object) objects.emplace(track->key, track->object);
    });
    std::vector<FusedObject> changed;
    is.ForEachBesides(was, [&](const TrackPtr& track) {
      if (!track->object) return;
      const auto own = objects.find(track->key);
      const bool is_same = own != objects.end() && own->second == track->object;
      if (own != objects.end()) objects.erase(own);
      if (!is_same) changed.push_back({track->key, track->object});
    });
    for (const auto& [track, object] : objects) {
      changed.push_back({std::string(track), nullptr});
    }
    std::sort(changed.begin(), changed.end(), IsBefore);
    return changed;
  }
  int64_t ByteSize(const StatePtr& state, const StatePtr& older) const override {
    const auto& own = static_cast<const EvidenceState&>(*state);
    const auto bytes =
        static_cast<int64_t>(sizeof(EvidenceState) + own.views.views().size() * sizeof(View));
    if (!older) return bytes + own.tracks.Bytes();
    return bytes + own.tracks.BytesBesides(static_cast<const EvidenceState&>(*older).tracks);
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
