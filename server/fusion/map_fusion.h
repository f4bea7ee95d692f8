// The fused layers of a map, which add edits to the revisions that the map's writer makes.
#ifndef HYPERMAP_SERVER_FUSION_MAP_FUSION_H_
#define HYPERMAP_SERVER_FUSION_MAP_FUSION_H_

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "base/limits/limits.h"
#include "map/edits/change.h"
#include "map/edits/edit.h"
#include "map/observations/robot_clocks.h"
#include "map/snapshot.h"
#include "server/fusion/fold_work.h"
#include "server/fusion/fused_layer.h"
#include "server/fusion/fusion_options.h"
#include "storage/map_store.h"

namespace hypermap::server {

// Makes a layer a fused one. Empty settings are the defaults. For a layer that is fused already,
// does nothing if its settings agree (an empty one agrees with any), and sets the exploration layer
// if it had none; otherwise FAILED_PRECONDITION.
struct StartFusion {
  std::string layer;
  storage::FusionSettings settings;
};

// Folds the whole log again with these settings. An empty strategy keeps the layer's own; empty
// parameters are the strategy's defaults.
struct RebuildFusion {
  std::string layer;
  std::string strategy;
  std::string parameters;
};

// Retracts the observations of a robot with from <= stamp < to. NOT_FOUND if there are none.
struct RetractObservations {
  std::string layer;
  std::string robot;
  absl::Time from = absl::InfinitePast();
  absl::Time to = absl::InfiniteFuture();
};

// Corrects the poses of robots' observations; `frame_id` is the frame of the poses. NOT_FOUND if
// one of the corrections concerns no observation.
struct CorrectPoses {
  std::string layer;
  std::string frame_id;
  std::vector<PoseCorrection> corrections;
};

using FusionCommand = std::variant<StartFusion, RebuildFusion, RetractObservations, CorrectPoses>;

// The edits that fused layers add to a revision.
struct FusionReaction {
  // Must be applied after the edits of the batch that they react to, in the same revision.
  std::vector<Edit> edits;
  // The layers that made the edits, in order, each with the index after its last edit. Empty if no
  // layer has changed, so that there is nothing to store.
  struct Part {
    FusedLayer* layer;
    size_t end;
  };
  std::vector<Part> parts;
};

// Loads a fused layer from the store on first use, and keeps it. For each revision the caller
//   1. calls React, Run or FoldAdmitted,
//   2. applies the edits of the reaction, and calls Finish (or GiveUp if they failed), and
//   3. calls Written when all revisions of the group are stored.
// If broken() is an error, none of the revisions since the last Written may be stored, and Reset
// goes back to the stored state. Other errors have changed nothing. Run, and the loading of layers
// and the folding of facts by React, end with the errors of CheckCancelled, which change nothing;
// everything else runs to its end. Not thread safe.
class MapFusion {
 public:
  // `stored` and `options` must outlive this.
  static absl::StatusOr<std::unique_ptr<MapFusion>> Open(storage::FusionLog* stored,
                                                         const FusionOptions* options,
                                                         const Limits& limits);

  // OK, or the error for which the revisions since the last Written must be dropped.
  const absl::Status& broken() const { return broken_; }

  // The reaction to a batch of edits; `applied` is its result on `before`. Edits of a fused layer's
  // objects are evidence: facts that an operator stated.
  absl::StatusOr<FusionReaction> React(const Snapshot& before, const EditBatch& batch,
                                       const AppliedBatch& applied);

  // Rebuilds, retracts and corrects on a copy of the layer, which replaces it in Finish.
  absl::StatusOr<FusionReaction> Run(const Snapshot& snapshot, const FusionCommand& command);

  // Adds observations to a layer's log, without folding it: FoldAdmitted does so once for many
  // submissions, which become one revision. Their stamps are judged by `now`. NOT_FOUND if there is
  // no such layer, FAILED_PRECONDITION if it is not fused.
  absl::StatusOr<std::vector<ObservationVerdict>> Admit(
      const Snapshot& snapshot, const std::string& layer,
      const std::vector<Observation>& observations, absl::Time now);
  absl::StatusOr<FusionReaction> FoldAdmitted(const Snapshot& snapshot, const std::string& layer);

  // The number of entries that FoldAdmitted would fold because of the one of the observations that
  // needs most (FusedLayer::EntriesToFold). Errors as Admit.
  absl::StatusOr<int64_t> EntriesToFold(const Snapshot& snapshot, const std::string& layer,
                                        const std::vector<Observation>& observations);
  // Folds late observations in advance, until `stop` returns true (FusedLayer::ContinueLate);
  // begins with them if `begin`, or if the work of the lane was lost. Returns the number of entries
  // that are left. Errors as Admit and EvidenceLog::Visit, with which the work is lost.
  absl::StatusOr<int64_t> FoldLate(const Snapshot& snapshot, const std::string& layer,
                                   FusedLayer::Lane lane, bool begin,
                                   absl::Span<const FusedLayer::LateObservation> observations,
                                   absl::FunctionRef<bool()> stop);
  // Drops the work of the lane, if there is any.
  void DropLate(const std::string& layer, FusedLayer::Lane lane);

  // Must be called when the edits of the reaction were applied; `object_ids` has an id for each.
  // Returns the changes to store with the revision.
  std::vector<storage::FusionChange> Finish(const FusionReaction& reaction,
                                            absl::Span<const ObjectId> object_ids);
  // Must be called if the edits of a reaction could not be applied. Drops the copy that Run made; a
  // reaction whose layers were changed themselves leaves fusion broken.
  void GiveUp(const absl::Status& status);
  // Makes fusion broken: work on the layers has ended at an unknown place.
  void Break(const absl::Status& status) { Broken(status).IgnoreError(); }

  // A fused layer, loaded if necessary; valid until Written, Reset or the layer's deletion. Errors
  // as Admit.
  absl::StatusOr<FusedLayer*> Find(const Snapshot& snapshot, const std::string& layer);

  // Bytes of memory that the states of the loaded layers take: an estimate.
  int64_t bytes() const;

  // Returns whether any fused layer is loaded, which Reset would drop.
  bool has_loaded_layers() const { return !layers_.empty(); }

  // Must be called when all revisions since the last call are stored.
  void Written();
  // Drops all layers and reads the settings from the store again.
  absl::Status Reset();
  // Forgets the evidence up to checkpoints that were stored before `stored_before`. Changes nothing
  // that layers show. Returns the layers whose logs begin later now. Errors of the log. REQUIRES:
  // all revisions are stored.
  absl::StatusOr<std::vector<std::string>> ForgetEvidence(absl::Time stored_before);
  // Stores a checkpoint of each loaded layer with entries that no stored checkpoint contains.
  void KeepCheckpoints();

  // What folding has cost since the map was opened.
  const FoldWork& work() const { return work_; }

  // The clocks of the robots that sent observations since the map was opened.
  const RobotClocks& robot_clocks() const { return robot_clocks_; }

 private:
  MapFusion(storage::FusionLog* stored, const FusionOptions* options, const Limits& limits)
      : stored_(stored), options_(options), limits_(limits) {}

  absl::StatusOr<FusionReaction> Do(const Snapshot& snapshot, const StartFusion& command);
  absl::StatusOr<FusionReaction> Do(const Snapshot& snapshot, const RebuildFusion& command);
  absl::StatusOr<FusionReaction> Do(const Snapshot& snapshot, const RetractObservations& command);
  absl::StatusOr<FusionReaction> Do(const Snapshot& snapshot, const CorrectPoses& command);

  // Makes a layer a fused one that is not yet.
  absl::Status Begin(const Snapshot& snapshot, const StartFusion& command);
  // Folds the changes of a copy of the layer.
  absl::StatusOr<FusionReaction> Try(const Snapshot& snapshot, const std::string& layer,
                                     std::unique_ptr<FusedLayer> changed);
  // Folds the changes of these layers.
  absl::StatusOr<FusionReaction> Fold(const Snapshot& snapshot,
                                      const std::vector<FusedLayer*>& layers);
  // A fused layer whose objects a batch edits, and these edits.
  struct Touched {
    FusedLayer* layer;
    std::vector<OperatorEdit> edits;
  };
  // Loads the fused layers whose objects the batch edits, as they are before it, but for those that
  // it deletes.
  absl::StatusOr<std::vector<Touched>> TouchedBy(const Snapshot& before, const EditBatch& batch,
                                                 const AppliedBatch& applied);
  void Drop(const std::string& layer);
  // Sets broken_ unless it is an error already; returns `status`.
  absl::Status Broken(const absl::Status& status);

  storage::FusionLog* const stored_;
  const FusionOptions* const options_;
  const Limits limits_;
  FoldWork work_;                                              // outlives the layers
  std::map<std::string, storage::FusionSettings> settings_;    // of all fused layers
  std::map<std::string, std::unique_ptr<FusedLayer>> layers_;  // the loaded ones
  // Layers that were deleted since the last Written: the store still has their logs.
  std::set<std::string> deleted_;
  // The changed copy of a layer, between Run and Finish.
  struct Tried {
    std::string layer;
    std::unique_ptr<FusedLayer> fused;
  };
  std::optional<Tried> tried_;
  absl::Status broken_;
  RobotClocks robot_clocks_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_MAP_FUSION_H_
