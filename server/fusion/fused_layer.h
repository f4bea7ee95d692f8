// One fused layer: it shows the fold of its log, whatever order the entries arrived in.
#ifndef HYPERMAP_SERVER_FUSION_FUSED_LAYER_H_
#define HYPERMAP_SERVER_FUSION_FUSED_LAYER_H_

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "base/limits/limits.h"
#include "map/edits/change.h"
#include "map/edits/edit.h"
#include "map/fusion/strategy.h"
#include "map/observations/observe_answers.h"
#include "map/observations/robot_clocks.h"
#include "map/snapshot.h"
#include "server/fusion/evidence_log.h"
#include "server/fusion/fold_work.h"
#include "server/fusion/fusion_options.h"
#include "server/fusion/late_fold.h"
#include "server/fusion/log_fold.h"
#include "server/fusion/remembered_steps.h"
#include "server/fusion/shown_tracks.h"
#include "storage/fusion_log.h"

namespace hypermap::server {

// An operator's edit of an object of a fused layer.
struct OperatorEdit {
  fusion::OperatorFact::Kind kind = fusion::OperatorFact::Kind::kPin;
  ObjectPtr object;  // As put; for a removed one, as it was.
};

// The fold of a log, and the objects of the layer that show it. A revision is made in these steps:
//   1. Admit, Tell, Retract, Correct or Rebuild change the log.
//   2. Fold folds the changed part of the log, and returns the edits that make the layer show the
//      result.
//   3. The caller applies the edits. Finish gets the ids of new objects, and returns the changes to
//      store in the same transaction.
//   4. Written, when they are stored.
// Several revisions may be made before Written. After an error, except of Admit and FoldFacts and
// Rebuild's INVALID_ARGUMENT, the object must not be used any more; Open gives the stored state
// again. That includes the errors of CheckCancelled, which Open and Fold return. Not thread safe.
class FusedLayer {
 public:
  // Loads a layer from the store; `snapshot` is the newest. Counts what it folds in `work`.
  // `stored`, `options` and `work` must outlive this. Errors are those of the log and of the
  // strategy factory.
  static absl::StatusOr<std::unique_ptr<FusedLayer>> Open(const std::string& layer,
                                                          const storage::FusionSettings& settings,
                                                          storage::FusionLog* stored,
                                                          const FusionOptions* options,
                                                          const Snapshot& snapshot, FoldWork* work);
  // A new fused layer, with an empty log.
  static absl::StatusOr<std::unique_ptr<FusedLayer>> Begin(const std::string& layer,
                                                           const storage::FusionSettings& settings,
                                                           storage::FusionLog* stored,
                                                           const FusionOptions* options,
                                                           FoldWork* work);

  // A copy, so that a long change can be given up: the original stays as it is. Costs a step for
  // each track. The one that is not used further must be dropped before the other one is written.
  // The copy has no late observations that are folded in advance.
  std::unique_ptr<FusedLayer> Copy() const;

  const storage::FusionSettings& settings() const { return settings_; }
  const EvidenceLog& log() const { return log_; }

  // The tracks that the object shows or has shown, sorted; empty if fusion did not make it.
  std::vector<fusion::TrackKey> TracksOf(ObjectId id) const { return shown_.TracksOf(id); }

  // Judges an observation in the form in which it was sent, and adds it to the log if it is
  // accepted. `now` is the server's time. Adds the stamp of a new observation to `clocks`.
  absl::StatusOr<ObservationVerdict> Admit(const Observation& observation, absl::Time now,
                                           const Snapshot& snapshot, const Limits& limits,
                                           RobotClocks* clocks);

  // The number of entries that Fold would fold because of the observation, which is not in the log:
  // an estimate. Entries whose folds can be repeated count as much less than one. 0 if the log has
  // an observation with its name; kAllEntries if there is no checkpoint before it in memory.
  static constexpr int64_t kAllEntries = std::numeric_limits<int64_t>::max();
  absl::StatusOr<int64_t> EntriesToFold(const Observation& observation) const;

  // Late observations, for which Fold would fold many entries, can be folded in advance: when Admit
  // adds all of them to the log, Fold takes the result. There are lanes for two such works at a
  // time. The log may change between the steps, which only costs work that is then done again.
  enum class Lane { kNear, kFar };
  static constexpr int kNumLanes = 2;
  struct LateObservation {
    const Observation* observation;
    absl::Time now;  // by which Admit will judge it
  };
  // Begins with those of the observations that Admit would accept, in place of what the lane had.
  // Returns false if it would accept none.
  absl::StatusOr<bool> BeginLate(Lane lane, absl::Span<const LateObservation> observations,
                                 const Snapshot& snapshot, const Limits& limits);
  // Goes on until `stop`, which is asked after each entry, returns true. Returns the number of
  // entries that are left for Fold: an estimate as that of EntriesToFold. REQUIRES: HasLate(lane).
  // Errors as EvidenceLog::Visit, after which the work is lost.
  absl::StatusOr<int64_t> ContinueLate(Lane lane, absl::FunctionRef<bool()> stop);
  // False also when the lane's work was lost by a change of the log or of the settings.
  bool HasLate(Lane lane) const { return late_[static_cast<int>(lane)].has_value(); }
  void DropLate(Lane lane) { late_[static_cast<int>(lane)].reset(); }

  // The facts of a batch of edits, and the state after them.
  struct FoldedFacts {
    struct Fact {
      ObjectId id = 0;  // The object's.
      std::shared_ptr<const fusion::OperatorFact> fact;
    };
    std::vector<Fact> facts;
    fusion::StatePtr state;
  };
  // Folds the facts that operators put or removed objects, without adding them to the log. No two
  // edits may be of one object. Near-linear in the tracks and facts, if few tracks have boxes that
  // intersect. Errors of CheckCancelled.
  absl::StatusOr<FoldedFacts> FoldFacts(absl::Span<const OperatorEdit> edits) const;
  // Adds the facts to the log. The layer must be as it was when they were folded, and the snapshot
  // that Fold gets must contain the operators' edits.
  void Tell(FoldedFacts folded);

  // Retracts the observations of a robot with from <= stamp < to. Returns their number.
  // FAILED_PRECONDITION if some of them may be forgotten.
  absl::StatusOr<int64_t> Retract(const std::string& robot, absl::Time from, absl::Time to);

  // Adds a correction, in the layer's frame, to the log. Returns the number of observations that it
  // corrects; 0: nothing has changed. FAILED_PRECONDITION if some of them may be forgotten.
  absl::StatusOr<int64_t> Correct(const PoseCorrection& correction);

  // Makes Fold start at the beginning of the log, with other settings. What evidence before it did
  // stays as it is, so that there the strategy can't change: FAILED_PRECONDITION.
  absl::Status Rebuild(const storage::FusionSettings& settings);
  // Sets the layer on which observations mark explored floor, from the next one on.
  void SetExplorationLayer(const std::string& layer);

  // Folds the changed part of the log. Returns the edits that make `snapshot` show the result; none
  // if it does already.
  absl::StatusOr<std::vector<Edit>> Fold(const Snapshot& snapshot);
  // `object_ids` has an id for each edit of Fold (AppliedBatch::object_ids). Returns the changes to
  // store.
  storage::FusionChange Finish(absl::Span<const ObjectId> object_ids);

  // Must be called when all changes that Finish returned are stored. Stores a checkpoint now and
  // then.
  absl::Status Written();
  // Stores a checkpoint if at least `min_entries` entries are in no stored checkpoint. States above
  // max_checkpoint_bytes are not stored.
  absl::Status KeepCheckpoint(int64_t min_entries);

  // The store has forgotten the entries up to `base`, whose state is a checkpoint of this layer.
  // REQUIRES: there are no changes since the last Written.
  void Forget(const storage::LogKey& base);

  // Bytes of memory that the layer's state and checkpoints take: an estimate.
  int64_t bytes() const { return bytes_; }
  // Bytes by which the observation makes it grow at most: an estimate.
  int64_t MostGrowth(const Observation& observation) const {
    return strategy_->MostGrowth(observation);
  }

 private:
  // The judgement of an observation; with what the log gets, if it is accepted.
  struct Judged {
    ObservationVerdict verdict;
    std::shared_ptr<const Observation> kept;  // in the layer's frame; null if it is not accepted
    storage::LoggedObservation logged;
  };

  FusedLayer(std::string layer, storage::FusionSettings settings,
             std::shared_ptr<const fusion::Strategy> strategy, EvidenceLog log,
             storage::FusionLog* stored, const FusionOptions* options, FoldWork* work);
  FusedLayer(const FusedLayer&) = default;

  // The objects that the strategy shows at the tip.
  std::vector<fusion::FusedObject> ObjectsOfTip() const {
    return strategy_->Objects(fold_.tip().state);
  }
  // Returns the observation in the layer's frame, decoded from the bytes that are stored (`body`).
  // `sent` is the encoded observation.
  absl::StatusOr<Observation> AsKept(const Observation& observation, const Snapshot& snapshot,
                                     std::string sent, std::string* body) const;
  // Observations that the log is about to get, as the judgement of later ones depends on them.
  struct Expected {
    // By robot and sequence.
    std::map<std::pair<std::string, int64_t>, storage::FusionLog::Known> known;
    std::map<std::string, absl::Time> newest;  // stamps by robot
  };
  // Judges as Admit does, as if the log had the expected observations, which may be null. Changes
  // nothing but `clocks`, which may be null.
  absl::StatusOr<Judged> Judge(const Observation& observation, absl::Time now,
                               const Snapshot& snapshot, const Limits& limits,
                               const Expected* expected, RobotClocks* clocks);
  // Entries to fold after the newest checkpoint before the key, as EntriesToFold counts them.
  int64_t EntriesAfter(const storage::LogKey& key) const;
  // Folds all entries after the tip.
  absl::Status FoldOn();
  // The newest valid checkpoint before `key`, in memory or stored, or else the beginning of the
  // log.
  absl::StatusOr<FoldPoint> CheckpointBefore(const storage::LogKey& key);
  // Adds the edits that make the layer show the tip.
  void ShowTip(const Snapshot& snapshot, std::vector<Edit>* edits);
  // Goes on from the work of a lane whose observations have arrived. Returns false if there is none
  // that goes further than the checkpoints.
  bool TakeLate();
  // Sets bytes_.
  void CountBytes();
  // Notes that the log changed at `key`, and drops the checkpoints from there on.
  void ChangedAt(const storage::LogKey& key);
  // Lets the lanes drop what a change of the log at `key` has made invalid; of an observation that
  // was added, `body` is its encoded form.
  void ChangeLate(const storage::LogKey& key, std::optional<absl::string_view> body);

  absl::Status MarkExplored(const Snapshot& snapshot, std::vector<Edit>* edits) const;

  const std::string layer_;
  storage::FusionSettings settings_;
  std::shared_ptr<const fusion::Strategy> strategy_;
  EvidenceLog log_;
  storage::FusionLog* const stored_;
  const FusionOptions* const options_;
  FoldWork* const work_;

  ShownTracks shown_;
  fusion::StatePtr shown_state_;            // what the last ShowTip showed; null if there was none
  std::shared_ptr<RememberedSteps> steps_;  // shared with copies
  LogFold fold_;                            // its tip is the state that the layer shows
  std::array<std::optional<LateFold>, kNumLanes> late_;  // the work of each lane
  int64_t bytes_ = 0;
  int64_t new_entries_ = 0;  // entries that no stored checkpoint contains

  // Changes that are not folded yet: the first changed key, and the free space of accepted and
  // corrected observations, and that of retracted ones and of corrected ones before.
  std::optional<storage::LogKey> changed_at_;
  bool tip_is_shown_ = true;  // Whether Fold has returned the edits that show the tip.
  std::vector<Polygon> explored_;
  std::vector<Polygon> not_explored_;
  // Changes since the last Finish.
  bool settings_changed_ = false;
  std::optional<storage::LogKey> stale_from_;
  // Stored checkpoints from this key on are invalid; the store removes them when it writes the
  // group.
  std::optional<storage::LogKey> unwritten_stale_from_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_FUSED_LAYER_H_
