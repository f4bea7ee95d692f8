#include "server/exploration/map_explorations.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "map/edits/apply.h"
#include "server/exploration/exploration_start.h"
#include "server/session/map_session.h"
#include "server/session/same_request.h"

namespace hypermap::server {
namespace {

// Number of ended explorations whose progress is kept in memory.
constexpr size_t kMaxEnded = 256;

// The layer "explorations"; null if there is none yet. FAILED_PRECONDITION if it is of another
// kind; DATA_LOSS if it is damaged.
absl::StatusOr<std::shared_ptr<const SemanticLayer>> FindLayer(const Snapshot& snapshot) {
  HYPERMAP_RETURN_IF_ERROR(snapshot.CheckUndamaged({kExplorationsLayer}));
  const auto it = snapshot.layers.find(kExplorationsLayer);
  if (it == snapshot.layers.end()) return nullptr;
  HYPERMAP_RETURN_IF_ERROR(CheckKind(it->second->spec(), LayerKind::kSemantic));
  return AsSemantic(it->second);
}

// The frame of the layer "explorations", or the frame it will have if there is none yet.
const std::string& FrameOf(const SemanticLayer* layer, const Snapshot& snapshot) {
  return layer == nullptr ? snapshot.frame_id : layer->spec().frame_id;
}

absl::Status TooManyActive() {
  return absl::ResourceExhaustedError(absl::StrCat("a map has at most ",
                                                   FixedLimits::kMaxActiveExplorations,
                                                   " explorations that have not ended"));
}

// Charges the call for a copy of the layer's content, before it is read. Anybody may write large
// objects into this layer.
absl::Status TakeMemoryToRead(const SemanticLayer& layer) {
  constexpr int64_t kFreeBytes = 64 << 10;
  return layer.ByteSize() <= kFreeBytes ? absl::OkStatus() : TakeMemory(layer.ByteSize());
}

}  // namespace

absl::StatusOr<MapExplorations::Kept> MapExplorations::Read(ObjectId id) const {
  Kept kept;
  kept.snapshot = session_->snapshot();
  HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<const SemanticLayer> layer, FindLayer(*kept.snapshot));
  if (layer == nullptr) return absl::NotFoundError("there is no exploration");
  HYPERMAP_RETURN_IF_ERROR(TakeMemoryToRead(*layer));
  HYPERMAP_ASSIGN_OR_RETURN(ExplorationObjects objects, FindExploration(*layer, id));
  kept.layer = std::move(layer);
  kept.objects = std::move(objects);
  DropEndedLeases(*kept.layer, &kept.objects);
  return kept;
}

void MapExplorations::DropEndedLeases(const SemanticLayer& layer,
                                      ExplorationObjects* objects) const {
  std::erase_if(objects->goals, [&](const ExplorationGoal& goal) {
    const ObjectPtr object = layer.Find(goal.id);
    return object && session_->time().IsOver(*object);
  });
}

absl::Time MapExplorations::PassedTime() const {
  return absl::UnixEpoch() + session_->time().Passed();
}

void MapExplorations::LetGo(const SemanticLayer& layer) {
  std::erase_if(active_, [&layer](const auto& entry) {
    const ObjectPtr object = layer.Find(entry.first);
    if (!object) return true;
    const absl::StatusOr<Exploration> exploration = ToExploration(*object);
    return !exploration.ok() || !IsActive(*exploration);
  });
}

absl::StatusOr<MapExplorations::Active*> MapExplorations::Follow(const Kept& kept) {
  // The call may have waited for others.
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  LetGo(*kept.layer);
  std::unique_ptr<Active>& active = active_[kept.objects.exploration.id];
  if (!active) {
    if (active_.size() > FixedLimits::kMaxActiveExplorations) {
      active_.erase(kept.objects.exploration.id);
      return TooManyActive();
    }
    active = std::make_unique<Active>(room_);
  }
  HYPERMAP_RETURN_IF_ERROR(active->follower.Follow(*kept.snapshot, kept.objects));
  return active.get();
}

ExplorationProgress MapExplorations::Measure(Active* active) const {
  const double resolution_m = active->follower.geometry().resolution_m;
  ExplorationProgress progress;
  progress.cells = active->follower.explorer().progress();
  progress.cell_area_m2 = resolution_m * resolution_m;
  active->rate.Add(PassedTime(), progress.cells.explored);
  progress.rate_m2_per_s = active->rate.cells_per_s() * progress.cell_area_m2;
  return progress;
}

absl::StatusOr<ExplorationProgress> MapExplorations::Progress(const Kept& kept) {
  if (!IsActive(kept.objects.exploration)) return EndedProgress(kept);
  HYPERMAP_ASSIGN_OR_RETURN(Active* const active, Follow(kept));
  const ExplorationProgress progress = Measure(active);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  return progress;
}

absl::StatusOr<ExplorationProgress> MapExplorations::EndedProgress(const Kept& kept) {
  const Exploration& exploration = kept.objects.exploration;
  if (const auto it = ended_.find(exploration.id); it != ended_.end()) return it->second;
  Active passing(room_);
  HYPERMAP_RETURN_IF_ERROR(passing.follower.Follow(*kept.snapshot, kept.objects));
  ExplorationProgress progress = Measure(&passing);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  // The robots' positions are lost, so that all floor looks reachable; but the exploration ended
  // because none of the rest was.
  if (exploration.end_reason == EndReason::kOnlyUnreachableLeft) {
    progress.cells.unreachable += std::exchange(progress.cells.reachable, 0);
  }
  Remember(exploration.id, progress);
  return progress;
}

void MapExplorations::Remember(ObjectId ended, ExplorationProgress progress) {
  progress.rate_m2_per_s = 0.0;
  ended_[ended] = progress;
  if (ended_.size() > kMaxEnded) ended_.erase(ended_.begin());
}

absl::StatusOr<storage::Receipt> MapExplorations::Commit(const Kept& kept, std::vector<Edit> edits,
                                                         const std::string& author) {
  EditBatch batch;
  batch.edits = std::move(edits);
  batch.if_layers = {{kExplorationsLayer, kept.snapshot->LayerVersionOf(kExplorationsLayer)}};
  return session_->SubmitAndWait({std::move(batch), author, ""});
}

absl::StatusOr<ExplorationReport> MapExplorations::Get(ObjectId id, const std::string& frame_id) {
  MutexLock lock(&mutex_);
  HYPERMAP_ASSIGN_OR_RETURN(Kept kept, Read(id));
  ExplorationReport report;
  HYPERMAP_RETURN_IF_ERROR(
      SetFrame(*kept.snapshot, kept.layer->spec().frame_id, frame_id, &report));
  HYPERMAP_ASSIGN_OR_RETURN(ExplorationProgress progress, Progress(kept));
  report.progress = progress;
  report.objects = std::move(kept.objects);
  return report;
}

absl::StatusOr<ExplorationList> MapExplorations::List(const std::string& frame_id) const {
  const SnapshotPtr snapshot = session_->snapshot();
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<const SemanticLayer> layer, FindLayer(*snapshot));
  ExplorationList list;
  HYPERMAP_RETURN_IF_ERROR(SetFrame(*snapshot, FrameOf(layer.get(), *snapshot), frame_id, &list));
  if (layer == nullptr) return list;
  HYPERMAP_RETURN_IF_ERROR(TakeMemoryToRead(*layer));
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<ExplorationObjects> all, ReadExplorations(*layer));
  list.explorations = std::move(all);
  for (ExplorationObjects& objects : list.explorations) DropEndedLeases(*layer, &objects);
  return list;
}

absl::StatusOr<FrontierList> MapExplorations::ListFrontiers(ObjectId id,
                                                            const std::string& frame_id) {
  MutexLock lock(&mutex_);
  HYPERMAP_ASSIGN_OR_RETURN(const Kept kept, Read(id));
  const Exploration& exploration = kept.objects.exploration;
  FrontierList list;
  HYPERMAP_RETURN_IF_ERROR(SetFrame(*kept.snapshot, kept.layer->spec().frame_id, frame_id, &list));
  if (!IsActive(exploration)) {
    return absl::FailedPreconditionError(
        absl::StrCat("exploration ", exploration.id, " has ended"));
  }
  HYPERMAP_ASSIGN_OR_RETURN(Active* const active, Follow(kept));
  ExplorationFollower& follower = active->follower;
  list.exploration_id = exploration.id;
  list.frontiers = follower.explorer().ListFrontiers();
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  std::stable_sort(list.frontiers.begin(), list.frontiers.end(),
                   [](const auto& a, const auto& b) { return a.cells.size() > b.cells.size(); });
  list.geometry = follower.geometry();
  list.frame_from_floor = list.frame_from_layer * follower.layer_from_floor();
  return list;
}

absl::StatusOr<ExplorationView> MapExplorations::Start(const ExplorationStart& request) {
  MutexLock lock(&mutex_);
  HYPERMAP_ASSIGN_OR_RETURN(std::optional<ExplorationView> earlier, FindStarted(request));
  if (earlier) return *std::move(earlier);
  return Retried([&] {
    mutex_.AssertHeld();
    return TryStart(request);
  });
}

absl::StatusOr<std::optional<ExplorationView>> MapExplorations::FindStarted(
    const ExplorationStart& request) const {
  if (request.request_id.empty()) return std::nullopt;
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<storage::Receipt> receipt,
                            session_->FindReceipt(request.request_id));
  if (!receipt) return std::nullopt;
  HYPERMAP_RETURN_IF_ERROR(CheckSameRequest(*receipt, request.request_digest));
  const std::vector<ObjectId>& ids = receipt->object_ids;
  if (ids.empty() || ids.back() == 0) {
    return absl::InvalidArgumentError("request_id was used for something else");
  }
  HYPERMAP_ASSIGN_OR_RETURN(const Kept kept, Read(ids.back()));
  ExplorationView view;
  HYPERMAP_RETURN_IF_ERROR(
      SetFrame(*kept.snapshot, kept.layer->spec().frame_id, request.frame_id, &view));
  view.revision = receipt->revision;
  // The state at the start: the exploration may have ended since.
  view.objects.exploration = kept.objects.exploration;
  view.objects.exploration.state = ExplorationState::kActive;
  view.objects.exploration.end_reason = EndReason::kNone;
  view.objects.exploration.ended.reset();
  return view;
}

absl::StatusOr<MapExplorations::Trial> MapExplorations::Try(const Snapshot& snapshot,
                                                            const EditBatch& batch) const {
  HYPERMAP_ASSIGN_OR_RETURN(const AppliedBatch applied, Apply(snapshot, batch));
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<const SemanticLayer> layer,
                            FindLayer(*applied.snapshot));
  HYPERMAP_RETURN_IF_ERROR(TakeMemoryToRead(*layer));
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<ExplorationObjects> all, ReadExplorations(*layer));
  const auto num_active = std::count_if(
      all.begin(), all.end(), [](const auto& objects) { return IsActive(objects.exploration); });
  if (num_active > static_cast<ptrdiff_t>(FixedLimits::kMaxActiveExplorations)) {
    return TooManyActive();
  }
  // The newest exploration comes first: it is the one that `batch` puts.
  Trial trial{std::move(all.front()), std::make_unique<Active>(room_)};
  ExplorationFollower& follower = trial.active->follower;
  HYPERMAP_RETURN_IF_ERROR(follower.Follow(*applied.snapshot, trial.objects));
  const Explorer::Progress cells = follower.explorer().progress();
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  if (cells.explored + cells.reachable + cells.unreachable > 0) return trial;
  return absl::FailedPreconditionError(absl::StrCat("there is no floor of layer \"",
                                                    trial.objects.exploration.occupancy_layer,
                                                    "\" in the area"));
}

absl::StatusOr<ExplorationView> MapExplorations::TryStart(const ExplorationStart& request) {
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  const SnapshotPtr snapshot = session_->snapshot();
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<const SemanticLayer> layer, FindLayer(*snapshot));
  ExplorationView view;
  absl::Status status =
      SetFrame(*snapshot, FrameOf(layer.get(), *snapshot), request.frame_id, &view);
  HYPERMAP_RETURN_IF_ERROR(status);
  HYPERMAP_ASSIGN_OR_RETURN(EditBatch batch,
                            StartBatch(*snapshot, request, session_->time().Now()));
  if (layer != nullptr) {
    batch.if_layers = {{kExplorationsLayer, snapshot->LayerVersionOf(kExplorationsLayer)}};
  }
  HYPERMAP_ASSIGN_OR_RETURN(Trial trial, Try(*snapshot, batch));
  view.num_edits = static_cast<int64_t>(batch.edits.size());
  const absl::StatusOr<storage::Receipt> receipt = session_->SubmitAndWait(
      {std::move(batch), request.author, request.request_id, request.request_digest});
  // Another call has created one of the layers meanwhile: ABORTED makes Retried try again.
  if (absl::IsAlreadyExists(receipt.status())) {
    return absl::AbortedError(receipt.status().message());
  }
  HYPERMAP_RETURN_IF_ERROR(receipt.status());
  view.revision = receipt->revision;
  view.objects = std::move(trial.objects);
  view.objects.exploration.id = receipt->object_ids.back();
  active_[view.objects.exploration.id] = std::move(trial.active);
  return view;
}

absl::StatusOr<ExplorationView> MapExplorations::Stop(ObjectId id, const std::string& author) {
  MutexLock lock(&mutex_);
  return Retried([&] {
    mutex_.AssertHeld();
    return TryStop(id, author);
  });
}

absl::StatusOr<ExplorationView> MapExplorations::TryStop(ObjectId id, const std::string& author) {
  HYPERMAP_ASSIGN_OR_RETURN(Kept kept, Read(id));
  ExplorationView view;
  HYPERMAP_RETURN_IF_ERROR(SetFrame(*kept.snapshot, kept.layer->spec().frame_id, "", &view));
  if (IsActive(kept.objects.exploration)) {
    std::optional<ExplorationProgress> progress;
    if (active_.contains(kept.objects.exploration.id)) {
      const absl::StatusOr<ExplorationProgress> measured = Progress(kept);
      if (measured.ok()) progress = *measured;
    }
    std::vector<Edit> edits;
    End(EndReason::kStopped, &kept, &edits);
    view.num_edits = static_cast<int64_t>(edits.size());
    HYPERMAP_ASSIGN_OR_RETURN(const storage::Receipt receipt,
                              Commit(kept, std::move(edits), author));
    view.revision = receipt.revision;
    active_.erase(kept.objects.exploration.id);
    if (progress) Remember(kept.objects.exploration.id, *progress);
  }
  view.objects = std::move(kept.objects);
  return view;
}

void MapExplorations::End(EndReason reason, Kept* kept, std::vector<Edit>* edits) const {
  Exploration& exploration = kept->objects.exploration;
  exploration.state = ExplorationState::kEnded;
  exploration.end_reason = reason;
  exploration.ended = session_->time().Now();
  // Attributes that operators added to the object stay.
  SemanticObject object = *kept->layer->Find(exploration.id);
  for (const auto& [name, value] : ToObject(exploration).attributes) {
    object.attributes[name] = value;
  }
  edits->push_back(PutObject{kExplorationsLayer, std::move(object), ""});
  for (const ExplorationGoal& goal : kept->objects.goals) {
    edits->push_back(DeleteObject{kExplorationsLayer, goal.id, {}});
  }
  kept->objects.goals.clear();
}

}  // namespace hypermap::server
