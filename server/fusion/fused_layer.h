// One fused layer: it shows the fold of its log, whatever order the entries arrived in.
#ifndef HYPERMAP_SERVER_FUSION_FUSED_LAYER_H_
#define HYPERMAP_SERVER_FUSION_FUSED_LAYER_H_

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
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
#include "server/fusion/fusion_options.h"
#include "server/fusion/late_fold.h"
#include "server/fusion/log_fold.h"
#include "server/fusion/thing_index.h"
#include "storage/fusion_log.h"

namespace hypermap::server {

// An operator's edit of an object of a fused layer.
struct OperatorEdit {
  fusion::OperatorFact::Kind kind = fusion::OperatorFact::Kind::kPin;
  ObjectPtr object;  // As put; for a removed one, as it was.
};

// The fold of a log, and the objects of the layer that show it. A revision is made in these steps:
//   1. Admit, Tell, Retract or Rebuild change the log.
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
  // Loads a layer from the store; `snapshot` is the newest. `stored` and `options` must outlive
  // this. Errors are those of the log and of the strategy factory.
  static absl::StatusOr<std::unique_ptr<FusedLayer>> Open(const std::string& layer,
                                                          const storage::FusionSettings& settings,
                                                          storage::FusionLog* stored,
                                                          const FusionOptions* options,
                                                          const Snapshot& snapshot);
  // A new fused layer, with an empty log.
  static absl::StatusOr<std::unique_ptr<FusedLayer>> Begin(const std::string& layer,
                                                           const storage::FusionSettings& settings,
                                                           storage::FusionLog* stored,
                                                           const FusionOptions* options);

  // A copy, so that a long change can be given up: the original stays as it is. Costs a step for
  // each track. The one that is not used further must be dropped before the other one is written.
  // The copy has no late observations that are folded in advance.
  std::unique_ptr<FusedLayer> Copy() const;

  const storage::FusionSettings& settings() const { return settings_; }
  const EvidenceLog& log() const { return log_; }

  // The tracks that the object shows or has shown, sorted; empty if fusion did not make it.
  std::vector<fusion::TrackKey> TracksOf(ObjectId id) const;

  // Judges an observation in the form in which it was sent, and adds it to the log if it is
  // accepted. `now` is the server's time. Adds the stamp of a new observation to `clocks`.
  absl::StatusOr<ObservationVerdict> Admit(const Observation& observation, absl::Time now,
                                           const Snapshot& snapshot, const Limits& limits,
                                           RobotClocks* clocks);

  // The number of entries that Fold would fold because of the observation, which is not in the log:
  // an estimate. 0 if the log has an observation with its name; kAllEntries if there is no
  // checkpoint before it in memory.
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
  absl::StatusOr<int64_t> Retract(const std::string& robot, absl::Time from, absl::Time to);

  // Makes Fold start at the beginning of the log, with other settings.
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

  // Bytes of memory that the layer's state and checkpoints take: an estimate.
  int64_t bytes() const { return bytes_; }
  // Bytes by which the observation makes it grow at most: an estimate.
  int64_t MostGrowth(const Observation& observation) const {
    return strategy_->MostGrowth(observation);
  }

 private:
  // The object that shows a track.
  struct Shown {
    ObjectId id = 0;   // 0: not on the map yet
    ObjectPtr object;  // with id 0, so that it can be compared with a FusedObject
  };

  // The judgement of an observation; with what the log gets, if it is accepted.
  struct Judged {
    ObservationVerdict verdict;
    std::shared_ptr<const Observation> kept;  // in the layer's frame; null if it is not accepted
    storage::LoggedObservation logged;
  };

  FusedLayer(std::string layer, storage::FusionSettings settings,
             std::shared_ptr<const fusion::Strategy> strategy, EvidenceLog log,
             storage::FusionLog* stored, const FusionOptions* options);
  FusedLayer(const FusedLayer&) = default;

  // Loads ids_ from the store, and shown_ from the snapshot, as the tip shows it.
  absl::Status LoadShown(const Snapshot& snapshot);
  // Returns the observation in the layer's frame, decoded from the bytes that are stored (`body`).
  // `sent` is the encoded observation.
  absl::StatusOr<Observation> AsKept(const Observation& observation, const Snapshot& snapshot,
                                     std::string sent, std::string* body) const;
  // Observations that the log is about to get, as the judgement of later ones depends on them.
  struct Expected {
    std::map<std::pair<std::string, int64_t>, uint64_t> hashes;  // by robot and sequence
    std::map<std::string, absl::Time> newest;                    // stamps by robot
  };
  // Judges as Admit does, as if the log had the expected observations, which may be null. Changes
  // nothing but `clocks`, which may be null.
  absl::StatusOr<Judged> Judge(const Observation& observation, absl::Time now,
                               const Snapshot& snapshot, const Limits& limits,
                               const Expected* expected, RobotClocks* clocks);
  // Entries after the newest checkpoint before the key; kAllEntries if there is none.
  int64_t EntriesAfter(const storage::LogKey& key) const;
  // Folds all entries after the tip.
  absl::Status FoldOn();
  // The newest valid checkpoint before `key`, in memory or stored, or the state without evidence.
  absl::StatusOr<FoldPoint> CheckpointBefore(const storage::LogKey& key);
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

  // The object's track; for an object without one, a key for a track of its own.
  fusion::TrackKey TrackOf(ObjectId id) const;
  // Whether the object has lost its track to another object, so that fusion knows nothing of it.
  bool HasLostItsTrack(ObjectId id) const;
  // Whether the track shows or has shown another object than this one.
  bool IsTrackOfAnother(const fusion::TrackKey& track, ObjectId id) const;
  void SetId(const fusion::TrackKey& track, ObjectId id);
  // Assigns each object that an operator put to the track that the strategy made of it.
  void AdoptPinned(const std::vector<fusion::FusedObject>& fused);
  // Adds the edits that turn shown_ into the objects of the state.
  void Diff(const Snapshot& snapshot, std::vector<Edit>* edits);
  // Adds an edit if `shown` differs from the fused object.
  void Show(const fusion::FusedObject& fused, Shown* shown, std::vector<Edit>* edits);
  void Put(const fusion::FusedObject& fused, Shown* shown, std::vector<Edit>* edits);
  // Lets a new track keep the id of an equal object of a track that is gone: late evidence can give
  // a thing another founder, and so another track key. `gone_things` has the objects of `gone`.
  void Inherit(const fusion::FusedObject& fused, ThingIndex* gone_things, std::vector<Shown>* gone,
               Shown* shown);
  void Remove(const std::vector<Shown>& gone, const Snapshot& snapshot, std::vector<Edit>* edits);
  absl::Status MarkExplored(const Snapshot& snapshot, std::vector<Edit>* edits) const;

  const std::string layer_;
  storage::FusionSettings settings_;
  std::shared_ptr<const fusion::Strategy> strategy_;
  EvidenceLog log_;
  storage::FusionLog* const stored_;
  const FusionOptions* const options_;

  LogFold fold_;  // its tip is the state that the layer shows
  std::array<std::optional<LateFold>, kNumLanes> late_;  // the work of each lane
  int64_t bytes_ = 0;
  int64_t new_entries_ = 0;  // entries that no stored checkpoint contains

  std::map<fusion::TrackKey, Shown> shown_;
  // The ids of all tracks. A track that is not shown any more keeps its id, so that the object gets
  // it again if the track comes back.
  std::unordered_map<fusion::TrackKey, ObjectId> ids_;
  // The same pairs, sorted by id.
  std::set<std::pair<ObjectId, fusion::TrackKey>> tracks_by_id_;

  // Changes that are not folded yet: the first changed key, the free space of accepted and of
  // retracted observations, and the objects that an operator put.
  std::optional<storage::LogKey> changed_at_;
  bool tip_is_shown_ = true;  // Whether Fold has returned the edits that show the tip.
  std::vector<Polygon> explored_;
  std::vector<Polygon> not_explored_;
  std::map<fusion::TrackKey, ObjectPtr> pinned_;
  // Result of the last Fold: the track of each edit that puts a new object, by the edit's index.
  std::map<size_t, fusion::TrackKey> new_objects_;
  // Changes since the last Finish.
  std::set<fusion::TrackKey> changed_tracks_;
  bool settings_changed_ = false;
  std::optional<storage::LogKey> stale_from_;
  // Stored checkpoints from this key on are invalid; the store removes them when it writes the
  // group.
  std::optional<storage::LogKey> unwritten_stale_from_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_FUSED_LAYER_H_
