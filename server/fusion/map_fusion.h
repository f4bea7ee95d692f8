// The fused layers of a map, as steps of its writer.
#ifndef HYPERMAP_SERVER_FUSION_MAP_FUSION_H_
#define HYPERMAP_SERVER_FUSION_MAP_FUSION_H_

#include <map>
#include <memory>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/edits/apply.h"
#include "map/edits/edit.h"
#include "map/snapshot.h"
#include "server/fusion/fused_layer.h"
#include "server/fusion/fusion_options.h"
#include "storage/map_store.h"

namespace hypermap::server {

// Makes a layer a fused one, or finds it fused. What is empty is the layer's own, or a default.
// FAILED_PRECONDITION when it is fused in another way.
struct StartFusion {
  std::string layer;
  storage::FusionSettings settings;
};

// Fuses all evidence again. An empty strategy is the layer's own.
struct RebuildFusion {
  std::string layer;
  std::string strategy;
  std::string parameters;
};

// Takes back what a robot saw at from <= stamp < to. NOT_FOUND when that is nothing.
struct RetractObservations {
  std::string layer;
  std::string robot;
  absl::Time from = absl::InfinitePast();
  absl::Time to = absl::InfiniteFuture();
};

using FusionCommand = std::variant<StartFusion, RebuildFusion, RetractObservations>;

// One revision: what a batch became with what fusion made of it.
struct FusionStep {
  AppliedBatch applied;
  std::vector<storage::FusionChange> changes;
};

// Layers are read from the store when they are first needed. Each step is judged by what the ones
// before it made of the map; when all of them are stored, Written is called. After an error that
// broken() tells of, none of the steps since the last Written may be stored, and Reset goes back to
// there; other errors changed nothing. One thread.
class MapFusion {
 public:
  // Both outlive this.
  static absl::StatusOr<std::unique_ptr<MapFusion>> Open(storage::FusionLog* stored,
                                                         const FusionOptions* options,
                                                         const EditLimits& limits);

  // OK, or why the steps since the last Written are lost.
  const absl::Status& broken() const { return broken_; }

  // An edit batch: what it does to objects of fused layers is evidence, an operator's word.
  absl::StatusOr<FusionStep> Edit(const Snapshot& snapshot, const EditBatch& batch);

  // An empty list of changes: nothing was to be done, and `applied` is empty.
  absl::StatusOr<FusionStep> Run(const Snapshot& snapshot, const FusionCommand& command);

  // Observations of a layer, in two steps, so that many submissions become one revision. NOT_FOUND
  // and FAILED_PRECONDITION when the layer is not there or not fused.
  absl::StatusOr<std::vector<ObservationVerdict>> Admit(
      const Snapshot& snapshot, const std::string& layer,
      const std::vector<Observation>& observations, absl::Time now);
  absl::StatusOr<FusionStep> FoldAdmitted(const Snapshot& snapshot, const std::string& layer);

  // The layer. Errors as Admit.
  absl::StatusOr<FusedLayer*> Find(const Snapshot& snapshot, const std::string& layer);

  void Written();
  absl::Status Reset();
  // Stores checkpoints of what has none.
  void KeepCheckpoints();

 private:
  MapFusion(storage::FusionLog* stored, const FusionOptions* options, const EditLimits& limits)
      : stored_(stored), options_(options), limits_(limits) {}

  absl::StatusOr<FusionStep> Do(const Snapshot& snapshot, const StartFusion& command);
  absl::StatusOr<FusionStep> Do(const Snapshot& snapshot, const RebuildFusion& command);
  absl::StatusOr<FusionStep> Do(const Snapshot& snapshot, const RetractObservations& command);

  absl::Status Begin(const Snapshot& snapshot, const StartFusion& command);
  // Folds what the layers gathered, and carries it out behind `batch`.
  absl::StatusOr<FusionStep> Finish(const Snapshot& snapshot, const EditBatch& batch,
                                    const std::vector<FusedLayer*>& layers,
                                    const Snapshot& after_batch);
  // The fused layers whose objects the batch touches.
  absl::StatusOr<std::vector<FusedLayer*>> TouchedBy(const Snapshot& before,
                                                     const EditBatch& batch);
  // Tells the layers in use what the batch did to their objects.
  void Tell(const Snapshot& before, const EditBatch& batch, const AppliedBatch& applied);
  void Drop(const std::string& layer);
  absl::Status Broken(const absl::Status& status);

  storage::FusionLog* const stored_;
  const FusionOptions* const options_;
  const EditLimits limits_;
  std::map<std::string, storage::FusionSettings> settings_;
  std::map<std::string, std::unique_ptr<FusedLayer>> layers_;  // those in use
  // Deleted since the last Written: the store still has their evidence.
  std::set<std::string> deleted_;
  absl::Status broken_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_MAP_FUSION_H_
