// The interface of fusion strategies, which turn evidence into objects.
//
// A strategy is a pure fold. Its state is an immutable value: folding an entry returns the next
// state and leaves the old one unchanged, so that a checkpoint costs a pointer. The same entries in
// the same order give the same state on every run, bit for bit. A layer always shows the fold of
// its log in the order of the entries' keys, whatever order the entries arrived in.
#ifndef HYPERMAP_MAP_FUSION_STRATEGY_H_
#define HYPERMAP_MAP_FUSION_STRATEGY_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/objects/semantic_object.h"
#include "map/observations/observation.h"

namespace hypermap::fusion {

// Detectors see areas. A line or point that an operator put is compared with them as the area
// within this distance of it.
inline constexpr double kPinHalfWidth_m = 0.1;

// Identifies a thing that fusion tracks: "robot/sequence/detection" of the detection that founded
// it, or the key of the operator's fact that did. Folding the log again gives the same keys.
using TrackKey = std::string;

// A statement by an operator, which fusion takes as a fact.
struct OperatorFact {
  enum class Kind {
    // The object is there, with this label and shape. It takes over the track that it names, or
    // else the track that it overlaps; later detections of it found no other object and never
    // remove it.
    kPin,
    // The object is not there. Its track is no longer shown, and detections of its label in its
    // place count as the same mistake.
    kRemove,
  };
  Kind kind = Kind::kPin;
  TrackKey track;
  SemanticObject object;  // The id is ignored; the shape is in the layer's frame.
};

// An object that the layer shows. `object` has id 0; states share it until it changes.
struct FusedObject {
  TrackKey track;
  ObjectPtr object;
};

// A record of what a fold did with an observation; used to explain objects.
struct FoldReport {
  struct Association {
    int detection = 0;
    TrackKey track;    // Empty if taken for clutter.
    double score = 0;  // Agreement in [0, 1]; 1 for a founding detection.
  };
  std::vector<Association> associations;
  // Tracks that should have been detected and were not.
  std::vector<TrackKey> missed;
  // Existence in [0, 1] of each track that the observation affected, afterwards; 0 if removed.
  std::map<TrackKey, double> existence;
  // Tracks that were merged into others, as (from, into).
  std::vector<std::pair<TrackKey, TrackKey>> merged;
};

class State {
 public:
  virtual ~State() = default;
};
using StatePtr = std::shared_ptr<const State>;

// What a fold of an observation computed, by which folding it onto another state can be cheaper.
// Immutable.
class FoldStep {
 public:
  virtual ~FoldStep() = default;
  // Bytes of memory besides what the states before it have: an estimate.
  virtual int64_t bytes() const = 0;
};
using FoldStepPtr = std::shared_ptr<const FoldStep>;

// Folds facts one after another into one new state. Made by Strategy::FoldFacts.
class FactFold {
 public:
  virtual ~FactFold() = default;

  // Folds the next fact. Costs a step for each track near the fact's object. Breaks off when the
  // work of this thread is cancelled.
  virtual void Add(const OperatorFact& fact) = 0;
  // Returns the state after all facts. Must be called last, and once.
  virtual StatePtr Finish() = 0;
};

// Immutable and safe to use from many threads.
class Strategy {
 public:
  virtual ~Strategy() = default;

  virtual absl::string_view name() const = 0;

  // Returns the state without any evidence.
  virtual StatePtr Initial() const = 0;

  // Returns the state after an entry. `state` must be this strategy's. The observation is valid and
  // in the layer's frame. `report` may be null.
  virtual StatePtr Fold(const StatePtr& state, const Observation& observation,
                        FoldReport* report) const = 0;

  // Returns what Fold returns. `*step` is null, or what a fold of the same observation by this
  // strategy gave. It is repeated if the state has near the observation what that fold found there,
  // which costs a small part of a fold; otherwise it is replaced by a new one, or by null if the
  // strategy knows none.
  virtual StatePtr FoldAgain(const StatePtr& state, const Observation& observation,
                             FoldStepPtr* step) const {
    *step = nullptr;
    return Fold(state, observation, nullptr);
  }

  // Begins to fold facts that follow the entries of `state`. Costs a step for each track. The
  // result is that of folding the facts one by one. This must outlive the fold.
  virtual std::unique_ptr<FactFold> FoldFacts(const StatePtr& state) const = 0;
  // Folds a single fact.
  StatePtr Fold(const StatePtr& state, const OperatorFact& fact) const {
    const std::unique_ptr<FactFold> fold = FoldFacts(state);
    fold->Add(fact);
    return fold->Finish();
  }

  // Returns the objects that the layer shows, sorted by track.
  virtual std::vector<FusedObject> Objects(const StatePtr& state) const = 0;
  // Returns the tracks whose objects may differ in the two states, sorted by track, each with its
  // object in `after`, which is null if it is not shown; or nullopt if only Objects can tell. Costs
  // less than Objects if the states differ little.
  virtual std::optional<std::vector<FusedObject>> ChangedObjects(const StatePtr& /*before*/,
                                                                 const StatePtr& /*after*/) const {
    return std::nullopt;
  }

  // Bytes of memory of a state: an estimate. Without what it shares with `older`, unless that is
  // null. Linear in the tracks of both.
  virtual int64_t ByteSize(const StatePtr& state, const StatePtr& older) const = 0;
  // Bytes by which the observation makes a state grow at most: an estimate.
  virtual int64_t MostGrowth(const Observation& observation) const = 0;

  // Encodes a state exactly: the decoded state folds further entries as the original would. Decode
  // returns DATA_LOSS for bytes that are not a state of this strategy.
  virtual std::string Encode(const StatePtr& state) const = 0;
  virtual absl::StatusOr<StatePtr> Decode(absl::string_view bytes) const = 0;
};

// The names of all strategies, the default first.
std::vector<std::string> StrategyNames();

// Makes a strategy with parameters given as a JSON object of numbers ("{}" or empty: the defaults).
// INVALID_ARGUMENT for an unknown name or parameter, or a value out of range.
absl::StatusOr<std::unique_ptr<Strategy>> MakeStrategy(absl::string_view name,
                                                       absl::string_view parameters);

// Returns the parameters that a layer stores when it is fused for the first time or again: those
// given, and what the strategy does otherwise in new layers than in stored ones that do not name
// it. Returns parameters that MakeStrategy refuses as they are.
std::string ParametersOfNewLayer(absl::string_view strategy, absl::string_view parameters);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_STRATEGY_H_
