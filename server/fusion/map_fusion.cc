#include "server/fusion/map_fusion.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/metering/thread_cpu.h"
#include "base/status/status_macros.h"
#include "map/layers/semantic_layer.h"

namespace hypermap::server {
namespace {

absl::Status CheckKind(const Snapshot& snapshot, const std::string& layer, LayerKind kind) {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr found, snapshot.GetLayer(layer));
  if (found->spec().kind == kind) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("layer \"", layer, "\" is of the kind ",
                                                    LayerKindName(found->spec().kind), ", not ",
                                                    LayerKindName(kind)));
}

// Fusion shows polygons: a layer that refuses them would make each revision with an object fail.
absl::Status CheckTakesPolygons(const Snapshot& snapshot, const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr found, snapshot.GetLayer(layer));
  if (found->spec().shape_kinds.Contains(ShapeKind::kPolygon)) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("layer \"", layer, "\" takes no polygons, which fusion makes of observations"));
}

// The layer whose object the edit puts or deletes; empty for other edits.
std::string LayerOfObjectEdit(const Edit& edit) {
  if (const auto* put = std::get_if<PutObject>(&edit)) return put->layer;
  if (const auto* remove = std::get_if<DeleteObject>(&edit)) return remove->layer;
  return "";
}

ObjectPtr FindObject(const Snapshot& snapshot, const std::string& layer, ObjectId id) {
  const auto* semantic = snapshot.FindSemantic(layer);
  return semantic == nullptr ? nullptr : semantic->Find(id);
}

// The names of the layers that the batch deleted, also of those that it made anew.
std::set<std::string> DeletedBy(const AppliedBatch& applied) {
  std::set<std::string> deleted;
  for (const Change& change : applied.changes) {
    if (const auto* layer = std::get_if<LayerDeleted>(&change)) deleted.insert(layer->spec.name);
  }
  return deleted;
}

absl::Status Mismatch(const std::string& layer, absl::string_view what, const std::string& has,
                      const std::string& wanted) {
  return absl::FailedPreconditionError(absl::StrCat("layer \"", layer, "\" is fused with ", what,
                                                    " \"", has, "\", not \"", wanted, "\""));
}

}  // namespace

absl::StatusOr<std::unique_ptr<MapFusion>> MapFusion::Open(storage::FusionLog* stored,
                                                           const FusionOptions* options,
                                                           const Limits& limits) {
  std::unique_ptr<MapFusion> fusion(new MapFusion(stored, options, limits));
  HYPERMAP_RETURN_IF_ERROR(fusion->Reset());
  return fusion;
}

absl::Status MapFusion::Reset() {
  layers_.clear();
  deleted_.clear();
  tried_.reset();
  auto settings = stored_->FusedLayers();
  if (!settings.ok()) {
    broken_ = settings.status();
    return broken_;
  }
  settings_ = {settings->begin(), settings->end()};
  broken_ = absl::OkStatus();
  return broken_;
}

absl::Status MapFusion::Broken(const absl::Status& status) {
  if (!status.ok() && broken_.ok()) broken_ = status;
  return status;
}

absl::StatusOr<FusedLayer*> MapFusion::Find(const Snapshot& snapshot, const std::string& layer) {
  HYPERMAP_RETURN_IF_ERROR(CheckKind(snapshot, layer, LayerKind::kSemantic));
  if (const auto open = layers_.find(layer); open != layers_.end()) return open->second.get();
  const auto settings = settings_.find(layer);
  if (settings == settings_.end()) {
    return absl::FailedPreconditionError(absl::StrCat("layer \"", layer, "\" is not a fused one"));
  }
  // Without it, observations would mark nothing as explored.
  HYPERMAP_RETURN_IF_ERROR(snapshot.CheckUndamaged({settings->second.exploration_layer}));
  absl::StatusOr<std::unique_ptr<FusedLayer>> fused =
      FusedLayer::Open(layer, settings->second, stored_, options_, snapshot, &work_);
  if (!fused.ok()) {
    return absl::Status(fused.status().code(),
                        absl::StrCat("layer \"", layer, "\": ", fused.status().message()));
  }
  return layers_.emplace(layer, *std::move(fused)).first->second.get();
}

absl::StatusOr<std::vector<MapFusion::Touched>> MapFusion::TouchedBy(const Snapshot& before,
                                                                     const EditBatch& batch,
                                                                     const AppliedBatch& applied) {
  const std::set<std::string> deleted = DeletedBy(applied);
  std::vector<Touched> touched;
  std::set<std::pair<std::string, ObjectId>> edited;
  for (size_t i = 0; i < batch.edits.size(); ++i) {
    const std::string layer = LayerOfObjectEdit(batch.edits[i]);
    if (layer.empty() || settings_.count(layer) == 0 || deleted.count(layer) > 0) continue;
    HYPERMAP_ASSIGN_OR_RETURN(FusedLayer * fused, Find(before, layer));
    auto own = std::find_if(touched.begin(), touched.end(),
                            [fused](const Touched& other) { return other.layer == fused; });
    if (own == touched.end()) own = touched.insert(own, Touched{fused, {}});
    const auto* remove = std::get_if<DeleteObject>(&batch.edits[i]);
    const ObjectId id = remove != nullptr ? remove->id : applied.object_ids[i];
    // The object's state after the batch counts, however often the batch edits it.
    if (!edited.emplace(layer, id).second) continue;
    const ObjectPtr after = FindObject(*applied.snapshot, layer, id);
    const ObjectPtr was = FindObject(before, layer, id);
    if (after) own->edits.push_back({fusion::OperatorFact::Kind::kPin, after});
    if (!after && was) own->edits.push_back({fusion::OperatorFact::Kind::kRemove, was});
  }
  return touched;
}

void MapFusion::Drop(const std::string& layer) {
  layers_.erase(layer);
  if (settings_.erase(layer) > 0) deleted_.insert(layer);
}

absl::StatusOr<FusionReaction> MapFusion::React(const Snapshot& before, const EditBatch& batch,
                                                const AppliedBatch& applied) {
  if (settings_.empty()) return FusionReaction();
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Touched> touched, TouchedBy(before, batch, applied));
  std::vector<FusedLayer::FoldedFacts> facts;
  for (const auto& [layer, edits] : touched) {
    HYPERMAP_ASSIGN_OR_RETURN(FusedLayer::FoldedFacts folded, layer->FoldFacts(edits));
    facts.push_back(std::move(folded));
  }
  // From here on the layers change. The rest is near-linear in their tracks and the facts.
  const ScopedCancellation to_the_end(nullptr);
  for (const std::string& layer : DeletedBy(applied)) Drop(layer);
  if (touched.empty()) return FusionReaction();
  std::vector<FusedLayer*> layers;
  for (size_t i = 0; i < touched.size(); ++i) {
    touched[i].layer->Tell(std::move(facts[i]));
    layers.push_back(touched[i].layer);
  }
  return Fold(*applied.snapshot, layers);
}

absl::StatusOr<FusionReaction> MapFusion::Fold(const Snapshot& snapshot,
                                               const std::vector<FusedLayer*>& layers) {
  FusionReaction reaction;
  for (FusedLayer* layer : layers) {
    absl::StatusOr<std::vector<Edit>> edits = layer->Fold(snapshot);
    if (!edits.ok()) return Broken(edits.status());
    std::move(edits->begin(), edits->end(), std::back_inserter(reaction.edits));
    reaction.parts.push_back({layer, reaction.edits.size()});
  }
  return reaction;
}

std::vector<storage::FusionChange> MapFusion::Finish(const FusionReaction& reaction,
                                                     absl::Span<const ObjectId> object_ids) {
  std::vector<storage::FusionChange> changes;
  size_t begin = 0;
  for (const FusionReaction::Part& part : reaction.parts) {
    changes.push_back(part.layer->Finish(object_ids.subspan(begin, part.end - begin)));
    begin = part.end;
  }
  if (tried_) {
    settings_[tried_->layer] = tried_->fused->settings();
    layers_[tried_->layer] = std::move(tried_->fused);
    tried_.reset();
  }
  return changes;
}

void MapFusion::GiveUp(const absl::Status& status) {
  if (tried_) {
    tried_.reset();
  } else {
    Broken(status).IgnoreError();
  }
}

absl::StatusOr<std::vector<ObservationVerdict>> MapFusion::Admit(
    const Snapshot& snapshot, const std::string& layer,
    const std::vector<Observation>& observations, absl::Time now) {
  HYPERMAP_ASSIGN_OR_RETURN(FusedLayer * fused, Find(snapshot, layer));
  std::vector<ObservationVerdict> verdicts;
  for (const Observation& observation : observations) {
    absl::StatusOr<ObservationVerdict> verdict =
        fused->Admit(observation, now, snapshot, limits_, &robot_clocks_);
    if (!verdict.ok()) return Broken(verdict.status());
    verdicts.push_back(*std::move(verdict));
  }
  return verdicts;
}

absl::StatusOr<int64_t> MapFusion::EntriesToFold(const Snapshot& snapshot, const std::string& layer,
                                                 const std::vector<Observation>& observations) {
  HYPERMAP_ASSIGN_OR_RETURN(const FusedLayer* const fused, Find(snapshot, layer));
  int64_t most = 0;
  for (const Observation& observation : observations) {
    HYPERMAP_ASSIGN_OR_RETURN(const int64_t entries, fused->EntriesToFold(observation));
    most = std::max(most, entries);
  }
  return most;
}

absl::StatusOr<int64_t> MapFusion::FoldLate(
    const Snapshot& snapshot, const std::string& layer, FusedLayer::Lane lane, bool begin,
    absl::Span<const FusedLayer::LateObservation> observations, absl::FunctionRef<bool()> stop) {
  const ScopedCpuTime cpu(&work_.cpu);
  HYPERMAP_ASSIGN_OR_RETURN(FusedLayer * fused, Find(snapshot, layer));
  if (begin || !fused->HasLate(lane)) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool begun,
                              fused->BeginLate(lane, observations, snapshot, limits_));
    if (!begun) return 0;
  }
  return fused->ContinueLate(lane, stop);
}

void MapFusion::DropLate(const std::string& layer, FusedLayer::Lane lane) {
  const auto open = layers_.find(layer);
  if (open != layers_.end()) open->second->DropLate(lane);
}

absl::StatusOr<FusionReaction> MapFusion::FoldAdmitted(const Snapshot& snapshot,
                                                       const std::string& layer) {
  const ScopedCpuTime cpu(&work_.cpu);
  absl::StatusOr<FusedLayer*> fused = Find(snapshot, layer);
  if (!fused.ok()) return Broken(fused.status());
  return Fold(snapshot, {*fused});
}

absl::StatusOr<FusionReaction> MapFusion::Run(const Snapshot& snapshot,
                                              const FusionCommand& command) {
  const ScopedCpuTime cpu(&work_.cpu);
  tried_.reset();
  return std::visit([&](const auto& c) { return Do(snapshot, c); }, command);
}

absl::StatusOr<FusionReaction> MapFusion::Try(const Snapshot& snapshot, const std::string& layer,
                                              std::unique_ptr<FusedLayer> changed) {
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<Edit> edits, changed->Fold(snapshot));
  FusionReaction reaction;
  reaction.parts.push_back({changed.get(), edits.size()});
  reaction.edits = std::move(edits);
  tried_ = Tried{layer, std::move(changed)};
  return reaction;
}

absl::Status MapFusion::Begin(const Snapshot& snapshot, const StartFusion& command) {
  if (!options_->codec.encode_observation) {
    return absl::FailedPreconditionError("this server does not take observations");
  }
  // The new log would see the entries of the old one, which is still stored.
  if (deleted_.count(command.layer) > 0) {
    return absl::AbortedError(
        absl::StrCat("layer \"", command.layer, "\" is just being made anew"));
  }
  HYPERMAP_RETURN_IF_ERROR(CheckTakesPolygons(snapshot, command.layer));
  storage::FusionSettings settings = command.settings;
  if (settings.strategy.empty()) settings.strategy = options_->default_strategy;
  if (settings.strategy.empty() && !fusion::StrategyNames().empty()) {
    settings.strategy = fusion::StrategyNames().front();
  }
  settings.parameters = fusion::ParametersOfNewLayer(settings.strategy, settings.parameters);
  if (!settings.exploration_layer.empty()) {
    auto status = CheckKind(snapshot, settings.exploration_layer, LayerKind::kExploration);
    HYPERMAP_RETURN_IF_ERROR(status);
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<FusedLayer> fused,
                            FusedLayer::Begin(command.layer, settings, stored_, options_, &work_));
  settings_[command.layer] = settings;
  layers_[command.layer] = std::move(fused);
  return absl::OkStatus();
}

absl::StatusOr<FusionReaction> MapFusion::Do(const Snapshot& snapshot, const StartFusion& command) {
  auto status = CheckKind(snapshot, command.layer, LayerKind::kSemantic);
  HYPERMAP_RETURN_IF_ERROR(status);
  if (settings_.count(command.layer) == 0) {
    const ScopedCancellation to_the_end(nullptr);
    HYPERMAP_RETURN_IF_ERROR(Begin(snapshot, command));
    return Fold(snapshot, {layers_[command.layer].get()});
  }
  HYPERMAP_ASSIGN_OR_RETURN(FusedLayer * fused, Find(snapshot, command.layer));
  const ScopedCancellation to_the_end(nullptr);
  storage::FusionSettings settings = fused->settings();
  const storage::FusionSettings& wanted = command.settings;
  if (!wanted.strategy.empty() && wanted.strategy != settings.strategy) {
    return Mismatch(command.layer, "strategy", settings.strategy, wanted.strategy);
  }
  if (!wanted.parameters.empty() && wanted.parameters != settings.parameters &&
      fusion::ParametersOfNewLayer(settings.strategy, wanted.parameters) != settings.parameters) {
    return Mismatch(command.layer, "parameters", settings.parameters, wanted.parameters);
  }
  if (wanted.exploration_layer.empty() || wanted.exploration_layer == settings.exploration_layer) {
    return FusionReaction();
  }
  if (!settings.exploration_layer.empty()) {
    return Mismatch(command.layer, "exploration_layer", settings.exploration_layer,
                    wanted.exploration_layer);
  }
  status = CheckKind(snapshot, wanted.exploration_layer, LayerKind::kExploration);
  HYPERMAP_RETURN_IF_ERROR(status);
  settings.exploration_layer = wanted.exploration_layer;
  fused->SetExplorationLayer(settings.exploration_layer);
  settings_[command.layer] = settings;
  return Fold(snapshot, {fused});
}

absl::StatusOr<FusionReaction> MapFusion::Do(const Snapshot& snapshot,
                                             const RebuildFusion& command) {
  HYPERMAP_ASSIGN_OR_RETURN(const FusedLayer* const fused, Find(snapshot, command.layer));
  storage::FusionSettings settings = fused->settings();
  if (!command.strategy.empty()) settings.strategy = command.strategy;
  settings.parameters = fusion::ParametersOfNewLayer(settings.strategy, command.parameters);
  std::unique_ptr<FusedLayer> rebuilt = fused->Copy();
  HYPERMAP_RETURN_IF_ERROR(rebuilt->Rebuild(settings));
  return Try(snapshot, command.layer, std::move(rebuilt));
}

absl::StatusOr<FusionReaction> MapFusion::Do(const Snapshot& snapshot,
                                             const RetractObservations& command) {
  HYPERMAP_ASSIGN_OR_RETURN(const FusedLayer* const fused, Find(snapshot, command.layer));
  std::unique_ptr<FusedLayer> rest = fused->Copy();
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t retracted,
                            rest->Retract(command.robot, command.from, command.to));
  if (retracted == 0) {
    return absl::NotFoundError(absl::StrCat("layer \"", command.layer,
                                            "\" has no observations of robot \"", command.robot,
                                            "\" in that time"));
  }
  return Try(snapshot, command.layer, std::move(rest));
}

absl::StatusOr<FusionReaction> MapFusion::Do(const Snapshot& snapshot,
                                             const CorrectPoses& command) {
  HYPERMAP_ASSIGN_OR_RETURN(const FusedLayer* const fused, Find(snapshot, command.layer));
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr layer, snapshot.GetLayer(command.layer));
  HYPERMAP_ASSIGN_OR_RETURN(const std::string frame, snapshot.ResolveFrame(command.frame_id));
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform layer_from_frame,
                            snapshot.frames.Lookup(layer->spec().frame_id, frame));
  std::unique_ptr<FusedLayer> corrected = fused->Copy();
  for (const PoseCorrection& told : command.corrections) {
    // In the layer's frame, in which it is stored.
    const PoseCorrection correction = Transformed(told, layer_from_frame);
    HYPERMAP_RETURN_IF_ERROR(Validate(correction));
    HYPERMAP_ASSIGN_OR_RETURN(const int64_t changed, corrected->Correct(correction));
    if (changed > 0) continue;
    return absl::NotFoundError(absl::StrCat("layer \"", command.layer,
                                            "\" has no observations of robot \"", correction.robot,
                                            "\" at the times of the poses"));
  }
  return Try(snapshot, command.layer, std::move(corrected));
}

void MapFusion::Written() {
  const ScopedCpuTime cpu(&work_.cpu);
  deleted_.clear();
  for (auto it = layers_.begin(); it != layers_.end();) {
    // A layer in an unknown state is dropped and loaded from the store on next use.
    it = it->second->Written().ok() ? std::next(it) : layers_.erase(it);
  }
}

int64_t MapFusion::bytes() const {
  int64_t bytes = 0;
  for (const auto& [name, layer] : layers_) bytes += layer->bytes();
  return bytes;
}

absl::StatusOr<std::vector<std::string>> MapFusion::ForgetEvidence(absl::Time stored_before) {
  std::vector<std::string> moved;
  for (const auto& [layer, settings] : settings_) {
    HYPERMAP_ASSIGN_OR_RETURN(const std::optional<storage::FusionCheckpoint> base,
                              stored_->FindNextBase(layer, stored_before));
    if (!base) continue;
    // A state of another version may not be readable. Later ones will be.
    HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<fusion::Strategy> strategy,
                              options_->make_strategy(settings.strategy, settings.parameters));
    if (!strategy->Decode(base->state).ok()) continue;
    HYPERMAP_RETURN_IF_ERROR(stored_->MoveBase(layer, base->key));
    if (const auto open = layers_.find(layer); open != layers_.end()) {
      open->second->Forget(base->key);
    }
    moved.push_back(layer);
  }
  return moved;
}

void MapFusion::KeepCheckpoints() {
  for (const auto& [name, layer] : layers_) layer->KeepCheckpoint(1).IgnoreError();
}

}  // namespace hypermap::server
