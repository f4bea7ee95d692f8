// One fused layer: it shows the fold of its log, whatever order the entries arrived in.
#ifndef HYPERMAP_SERVER_FUSION_FUSED_LAYER_H_
#define HYPERMAP_SERVER_FUSION_FUSED_LAYER_H_

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
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
  std::unique_ptr<FusedLayer> Copy() const {
    return std::unique_ptr<FusedLayer>(new FusedLayer(*this));
  }

  const storage::FusionSettings& settings() const { return settings_; }
  const EvidenceLog& log() const { return log_; }

  // The tracks that the object shows or has shown, sorted; empty if fusion did not make it.
  std::vector<fusion::TrackKey> TracksOf(ObjectId id) const;

  // Judges an observation in the form in which it was sent, and adds it to the log if it is
  // accepted. `now` is the server's time. Adds the stamp of a new observation to `clocks`.
  absl::StatusOr<ObservationVerdict> Admit(const Observation& observation, absl::Time now,
                                           const Snapshot& snapshot, const Limits& limits,
                                           RobotClocks* clocks);

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
  struct Checkpoint {
    storage::LogKey key;
    fusion::StatePtr state;
  };
  // A checkpoint in memory.
  struct KeptState {
    fusion::StatePtr state;
    int64_t unshared = 0;  // bytes of it that the next newer state does not share
  };
  using Checkpoints = std::map<storage::LogKey, KeptState>;
  // The object that shows a track.
  struct Shown {
    ObjectId id = 0;   // 0: not on the map yet
    ObjectPtr object;  // with id 0, so that it can be compared with a FusedObject
  };

  FusedLayer(std::string layer, storage::FusionSettings settings,
             std::unique_ptr<fusion::Strategy> strategy, EvidenceLog log,
             storage::FusionLog* stored, const FusionOptions* options);
  FusedLayer(const FusedLayer&) = default;

  // Loads ids_ and shown_ from the store and the snapshot.
  absl::Status LoadShown(const Snapshot& snapshot);
  // Returns the observation in the layer's frame, decoded from the bytes that are stored (`body`).
  // `sent` is the encoded observation.
  absl::StatusOr<Observation> AsKept(const Observation& observation, const Snapshot& snapshot,
                                     std::string sent, std::string* body) const;
  // Folds all entries after `from`.
  absl::Status FoldOn(Checkpoint from);
  // Makes `state` the tip. It is that after the entry `key`, the last one of `num_entries` after
  // the former tip.
  void Advance(const storage::LogKey& key, fusion::StatePtr state, int64_t num_entries);
  // The newest valid checkpoint before `key`, in memory or stored, or the state without evidence.
  absl::StatusOr<Checkpoint> CheckpointBefore(const storage::LogKey& key);
  // Keeps the state of tip_ in memory.
  void AddCheckpoint();
  // Sets `unshared` of the checkpoint before this one.
  void CountUnshared(Checkpoints::iterator newer);
  // Drops the oldest checkpoints until the others take at most max_checkpoint_bytes.
  void TrimCheckpoints();
  // Sets bytes_ for tip_ and the checkpoints.
  void CountBytes();
  // Notes that the log changed at `key`, and drops the checkpoints from there on.
  void ChangedAt(const storage::LogKey& key);

  // The object's track; for an object without one, the key of a track of its own.
  fusion::TrackKey TrackOf(ObjectId id) const;
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

  Checkpoint tip_;           // the state that the layer shows
  Checkpoints checkpoints_;  // in memory, at or before tip_
  int64_t bytes_ = 0;
  int64_t entries_since_checkpoint_ = 0;
  int64_t entries_folded_ = 0;
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
  bool tip_is_shown_ = true;  // Whether Fold has returned the edits that show tip_.
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
