// One fused layer: what it shows is the fold of its log, whatever order the entries came in.
#ifndef HYPERMAP_SERVER_FUSION_FUSED_LAYER_H_
#define HYPERMAP_SERVER_FUSION_FUSED_LAYER_H_

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "map/edits/apply.h"
#include "map/edits/edit.h"
#include "map/fusion/strategy.h"
#include "map/snapshot.h"
#include "server/fusion/evidence_log.h"
#include "server/fusion/fusion_options.h"
#include "storage/fusion_log.h"

namespace hypermap::server {

enum class ObservationOutcome {
  kAccepted,
  kDuplicate,    // the layer had it already
  kRefusedLate,  // older than the layer's newest by more than max_lateness
  kInvalid,      // no valid observation
  kConflict,     // the layer has another one with this robot and sequence
};

// What became of one observation.
struct ObservationVerdict {
  std::string robot;
  int64_t sequence = 0;
  ObservationOutcome outcome = ObservationOutcome::kAccepted;
  // When accepted: the revision it counts from; else the newest.
  Revision revision = 0;
  std::string message;  // why it was not accepted
};

// Used as: gather (Admit, Tell, Retract, Rebuild), Fold to the edits that bring the layer there,
// Finish with what they became, and, when all that is stored, Written. After an error of any of
// these but Admit and Rebuild's INVALID_ARGUMENT the object is of no use: open it again. One
// thread.
class FusedLayer {
 public:
  // The layer as it is stored; `snapshot` is the newest. Both pointers outlive this. Errors are
  // those of the log and of the strategy factory.
  static absl::StatusOr<std::unique_ptr<FusedLayer>> Open(const std::string& layer,
                                                          const storage::FusionSettings& settings,
                                                          storage::FusionLog* stored,
                                                          const FusionOptions* options,
                                                          const Snapshot& snapshot);
  // A layer that nothing is stored of.
  static absl::StatusOr<std::unique_ptr<FusedLayer>> Begin(const std::string& layer,
                                                           const storage::FusionSettings& settings,
                                                           storage::FusionLog* stored,
                                                           const FusionOptions* options);

  const storage::FusionSettings& settings() const { return settings_; }
  const EvidenceLog& log() const { return log_; }

  // The tracks that are shown as the object, by their names; empty when fusion did not make it.
  std::vector<fusion::TrackKey> TracksOf(ObjectId id) const;

  // Judges an observation as it was sent; takes it in when it is accepted.
  absl::StatusOr<ObservationVerdict> Admit(const Observation& observation, absl::Time now,
                                           const Snapshot& snapshot, const EditLimits& limits);

  // An operator put or removed an object, which the snapshot that Fold is given has (or has not)
  // already. Of a removed object, `object` is what it was.
  void Tell(fusion::OperatorFact::Kind kind, ObjectPtr object);

  // Takes back what a robot saw at from <= stamp < to. The number of observations.
  absl::StatusOr<int64_t> Retract(const std::string& robot, absl::Time from, absl::Time to);

  // Begins again with other settings, from the first entry of the log on.
  absl::Status Rebuild(const storage::FusionSettings& settings);
  // Marks what is admitted from now on there.
  void SetExplorationLayer(const std::string& layer);

  // Folds what was gathered. The edits that make `snapshot` show it, may be none.
  absl::StatusOr<std::vector<Edit>> Fold(const Snapshot& snapshot);
  // `object_ids` are those that the edits of Fold were given. What is to be stored.
  storage::FusionChange Finish(absl::Span<const ObjectId> object_ids);

  // What was gathered is stored; stores a checkpoint now and then.
  absl::Status Written();
  // Stores a checkpoint when at least this many entries are in none yet.
  absl::Status KeepCheckpoint(int64_t min_entries);

 private:
  struct Checkpoint {
    storage::LogKey key;
    fusion::StatePtr state;
  };
  struct Shown {
    ObjectId id = 0;
    ObjectPtr object;  // with id 0, as fusion has it
  };

  FusedLayer(std::string layer, storage::FusionSettings settings,
             std::unique_ptr<fusion::Strategy> strategy, EvidenceLog log,
             storage::FusionLog* stored, const FusionOptions* options);

  absl::Status LoadShown(const Snapshot& snapshot);
  // The observation as it is kept: in the layer's frame, and as its bytes have it.
  absl::StatusOr<Observation> AsKept(const Observation& observation, const Snapshot& snapshot,
                                     std::string* body) const;
  // Folds all that comes after `from`.
  absl::Status FoldOn(Checkpoint from);
  // Where to begin to fold an entry with this key.
  absl::StatusOr<Checkpoint> CheckpointBefore(const storage::LogKey& key);
  void AddCheckpoint();
  // The log changed at `key`: nothing that was folded from there on is true any more.
  void ChangedAt(const storage::LogKey& key);

  // The object's track, made where there is none.
  fusion::TrackKey TrackOf(ObjectId id);
  void SetId(const fusion::TrackKey& track, ObjectId id);
  // Gives the objects that an operator put to the tracks that took them over.
  void AdoptPinned(const std::vector<fusion::FusedObject>& fused);
  void Diff(const Snapshot& snapshot, std::vector<Edit>* edits);
  void Show(const fusion::FusedObject& fused, Shown* shown, std::vector<Edit>* edits);
  void Put(const fusion::FusedObject& fused, Shown* shown, std::vector<Edit>* edits);
  // A track that late evidence gave another founder goes on under its id.
  void Inherit(const fusion::FusedObject& fused, std::vector<Shown>* gone, Shown* shown);
  void Remove(const std::vector<Shown>& gone, const Snapshot& snapshot, std::vector<Edit>* edits);
  absl::Status MarkExplored(const Snapshot& snapshot, std::vector<Edit>* edits) const;

  const std::string layer_;
  storage::FusionSettings settings_;
  std::unique_ptr<fusion::Strategy> strategy_;
  EvidenceLog log_;
  storage::FusionLog* const stored_;
  const FusionOptions* const options_;

  Checkpoint tip_;                                           // all that is folded
  std::map<storage::LogKey, fusion::StatePtr> checkpoints_;  // at or before the tip
  int entries_since_checkpoint_ = 0;
  int64_t entries_folded_ = 0;
  int64_t new_entries_ = 0;  // that no stored checkpoint holds

  std::map<fusion::TrackKey, Shown> shown_;
  // Also of tracks that are not shown: they keep their ids.
  std::unordered_map<fusion::TrackKey, ObjectId> ids_;

  // Gathered, and not folded yet.
  std::optional<storage::LogKey> changed_at_;
  std::vector<Polygon> explored_;      // by observations that were admitted
  std::vector<Polygon> not_explored_;  // by those that were taken back
  std::map<fusion::TrackKey, ObjectPtr> pinned_;
  // Of the last Fold: the track of each edit that puts a new object, by the edit's index.
  std::map<size_t, fusion::TrackKey> new_objects_;
  std::set<fusion::TrackKey> changed_tracks_;
  bool settings_changed_ = false;
  std::optional<storage::LogKey> stale_from_;
  // Since the last Written: stored checkpoints from here on are not true any more.
  std::optional<storage::LogKey> unwritten_stale_from_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_FUSED_LAYER_H_
