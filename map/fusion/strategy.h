// How evidence becomes objects: the one interface of all fusion strategies.
//
// A strategy is a pure fold. Its state is an immutable value; folding an entry gives the next state
// and leaves the old one as it was, so that a state can be kept as a checkpoint at the price of a
// pointer. The same entries in the same order give the same state, bit for bit, on every run. What
// a layer shows is always the fold of its log in the order of its keys, whatever order the entries
// arrived in.
#ifndef HYPERMAP_MAP_FUSION_STRATEGY_H_
#define HYPERMAP_MAP_FUSION_STRATEGY_H_

#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/objects/semantic_object.h"
#include "map/observations/observation.h"

namespace hypermap::fusion {

// A line or point that an operator put stands for what a detector would see this far around it.
inline constexpr double kPinHalfWidth_m = 0.1;

// Names a thing that fusion follows: the detection that founded it, "robot/sequence/detection", or
// what an operator's fact calls it. Stable when the log is folded again.
using TrackKey = std::string;

// What an operator said: a fact that fusion keeps.
struct OperatorFact {
  enum class Kind {
    // The object is there, with this label and footprint. Takes over the track it names, else the
    // one that it lies on; later evidence of it makes no other object, and never removes it.
    kPin,
    // The object is not there: the track is removed, and what is detected in its place with its
    // label is taken for the same mistake.
    kRemove,
  };
  Kind kind = Kind::kPin;
  TrackKey track;
  SemanticObject object;  // id is ignored; polygon in the layer's frame
};

// An object that the layer shows; `object` has id 0 and is shared between states while it stays the
// same.
struct FusedObject {
  TrackKey track;
  ObjectPtr object;
};

// What a fold did with an observation, for explaining.
struct FoldReport {
  struct Association {
    int detection = 0;
    TrackKey track;    // empty: taken for clutter
    double score = 0;  // agreement in [0, 1]; 1 for a founding detection
  };
  std::vector<Association> associations;
  // Tracks that should have been seen and were not.
  std::vector<TrackKey> missed;
  // Of each track that was touched, afterwards; 0 for those removed.
  std::map<TrackKey, double> existence;
  // Tracks that became part of others: from, into.
  std::vector<std::pair<TrackKey, TrackKey>> merged;
};

class State {
 public:
  virtual ~State() = default;
};
using StatePtr = std::shared_ptr<const State>;

// Immutable; safe to use from many threads.
class Strategy {
 public:
  virtual ~Strategy() = default;

  virtual absl::string_view name() const = 0;

  // Before any evidence.
  virtual StatePtr Initial() const = 0;

  // `state` must be this strategy's. The observation is valid and in the layer's frame. `report`
  // may be null.
  virtual StatePtr Fold(const StatePtr& state, const Observation& observation,
                        FoldReport* report) const = 0;
  virtual StatePtr Fold(const StatePtr& state, const OperatorFact& fact) const = 0;

  // What the layer shows, sorted by track.
  virtual std::vector<FusedObject> Objects(const StatePtr& state) const = 0;

  // A state as bytes, exact: decoding gives a state that goes on as this one would. DATA_LOSS for
  // bytes that are no state of this strategy.
  virtual std::string Encode(const StatePtr& state) const = 0;
  virtual absl::StatusOr<StatePtr> Decode(absl::string_view bytes) const = 0;
};

// Names of all strategies, the default one first.
std::vector<std::string> StrategyNames();

// A strategy with parameters as a JSON object of numbers ("{}" or empty: its defaults).
// INVALID_ARGUMENT for a name, a parameter or a value that there is none of.
absl::StatusOr<std::unique_ptr<Strategy>> MakeStrategy(absl::string_view name,
                                                       absl::string_view parameters);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_STRATEGY_H_
