#include "server/exploration/exploration_desk.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "map/edits/apply.h"
#include "server/exploration/exploration_start.h"
#include "server/session/map_session.h"

namespace hypermap::server {
namespace {

// Number of ended explorations whose progress is kept in memory.
constexpr size_t kMaxEnded = 256;

// The layer "explorations"; null if there is none yet. FAILED_PRECONDITION if it is of another
// kind.
absl::StatusOr<std::shared_ptr<const SemanticLayer>> FindLayer(const Snapshot& snapshot) {
  const auto it = snapshot.layers.find(kExplorationsLayer);
  if (it == snapshot.layers.end()) return nullptr;
  if (auto status = CheckKind(it->second->spec(), LayerKind::kSemantic); !status.ok())
    return status;
  return AsSemantic(it->second);
}

// The frame of the layer "explorations", or the frame it will have if there is none yet.
const std::string& FrameOf(const SemanticLayer* layer, const Snapshot& snapshot) {
  return layer == nullptr ? snapshot.frame_id : layer->spec().frame_id;
}

absl::Status TooManyActive() {
  return absl::ResourceExhaustedError(absl::StrCat(
      "a map has at most ", ExplorationDesk::kMaxActive, " explorations that have not ended"));
}

}  // namespace

absl::StatusOr<ExplorationDesk::Kept> ExplorationDesk::Read(ObjectId id) const {
  Kept kept;
  kept.snapshot = session_->snapshot();
  absl::StatusOr<std::shared_ptr<const SemanticLayer>> layer = FindLayer(*kept.snapshot);
  if (!layer.ok()) return layer.status();
  if (*layer == nullptr) return absl::NotFoundError("there is no exploration");
  absl::StatusOr<ExplorationObjects> objects = FindExploration(**layer, id);
  if (!objects.ok()) return objects.status();
  kept.layer = *std::move(layer);
  kept.objects = *std::move(objects);
  DropEndedLeases(&kept.objects);
  return kept;
}

void ExplorationDesk::DropEndedLeases(ExplorationObjects* objects) const {
  const absl::Time now = session_->options().clock();
  std::erase_if(objects->goals, [now](const ExplorationGoal& goal) {
    return goal.expires_at && *goal.expires_at <= now;
  });
}

void ExplorationDesk::LetGo(const SemanticLayer& layer) {
  std::erase_if(active_, [&layer](const auto& entry) {
    const ObjectPtr object = layer.Find(entry.first);
    if (!object) return true;
    const absl::StatusOr<Exploration> exploration = ToExploration(*object);
    return !exploration.ok() || !IsActive(*exploration);
  });
}

absl::StatusOr<ExplorationDesk::Active*> ExplorationDesk::Follow(const Kept& kept) {
  LetGo(*kept.layer);
  std::unique_ptr<Active>& active = active_[kept.objects.exploration.id];
  if (!active) {
    if (active_.size() > kMaxActive) {
      active_.erase(kept.objects.exploration.id);
      return TooManyActive();
    }
    active = std::make_unique<Active>(max_cells_);
  }
  absl::Status status = active->follower.Follow(*kept.snapshot, kept.objects);
  if (!status.ok()) return status;
  return active.get();
}

ExplorationProgress ExplorationDesk::Measure(Active* active) const {
  const double resolution_m = active->follower.geometry().resolution_m;
  ExplorationProgress progress;
  progress.cells = active->follower.explorer().progress();
  progress.cell_area_m2 = resolution_m * resolution_m;
  active->rate.Add(session_->options().clock(), progress.cells.explored);
  progress.rate_m2_per_s = active->rate.cells_per_s() * progress.cell_area_m2;
  return progress;
}

absl::StatusOr<ExplorationProgress> ExplorationDesk::Progress(const Kept& kept) {
  if (!IsActive(kept.objects.exploration)) return EndedProgress(kept);
  const absl::StatusOr<Active*> active = Follow(kept);
  if (!active.ok()) return active.status();
  return Measure(*active);
}

absl::StatusOr<ExplorationProgress> ExplorationDesk::EndedProgress(const Kept& kept) {
  const Exploration& exploration = kept.objects.exploration;
  if (const auto it = ended_.find(exploration.id); it != ended_.end()) return it->second;
  Active passing(max_cells_);
  absl::Status status = passing.follower.Follow(*kept.snapshot, kept.objects);
  if (!status.ok()) return status;
  ExplorationProgress progress = Measure(&passing);
  // The robots' positions are lost, so that all floor looks reachable; but the exploration ended
  // because none of the rest was.
  if (exploration.end_reason == EndReason::kOnlyUnreachableLeft) {
    progress.cells.unreachable += std::exchange(progress.cells.reachable, 0);
  }
  Remember(exploration.id, progress);
  return progress;
}

void ExplorationDesk::Remember(ObjectId ended, ExplorationProgress progress) {
  progress.rate_m2_per_s = 0.0;
  ended_[ended] = progress;
  if (ended_.size() > kMaxEnded) ended_.erase(ended_.begin());
}

absl::StatusOr<storage::Receipt> ExplorationDesk::Commit(const Kept& kept, std::vector<Edit> edits,
                                                         const std::string& author) {
  EditBatch batch;
  batch.edits = std::move(edits);
  batch.if_layers = {{kExplorationsLayer, kept.snapshot->LayerVersionOf(kExplorationsLayer)}};
  return session_->SubmitAndWait({std::move(batch), author, ""});
}

absl::StatusOr<ExplorationReport> ExplorationDesk::Get(ObjectId id, const std::string& frame_id) {
  MutexLock lock(&mutex_);
  absl::StatusOr<Kept> kept = Read(id);
  if (!kept.ok()) return kept.status();
  ExplorationReport report;
  absl::Status status = SetFrame(*kept->snapshot, kept->layer->spec().frame_id, frame_id, &report);
  if (!status.ok()) return status;
  absl::StatusOr<ExplorationProgress> progress = Progress(*kept);
  if (!progress.ok()) return progress.status();
  report.progress = *progress;
  report.objects = std::move(kept->objects);
  return report;
}

absl::StatusOr<ExplorationList> ExplorationDesk::List(const std::string& frame_id) const {
  const SnapshotPtr snapshot = session_->snapshot();
  const absl::StatusOr<std::shared_ptr<const SemanticLayer>> layer = FindLayer(*snapshot);
  if (!layer.ok()) return layer.status();
  ExplorationList list;
  absl::Status status = SetFrame(*snapshot, FrameOf(layer->get(), *snapshot), frame_id, &list);
  if (!status.ok()) return status;
  if (*layer == nullptr) return list;
  absl::StatusOr<std::vector<ExplorationObjects>> all = ReadExplorations(**layer);
  if (!all.ok()) return all.status();
  list.explorations = *std::move(all);
  for (ExplorationObjects& objects : list.explorations) DropEndedLeases(&objects);
  return list;
}

absl::StatusOr<FrontierList> ExplorationDesk::ListFrontiers(ObjectId id,
                                                            const std::string& frame_id) {
  MutexLock lock(&mutex_);
  const absl::StatusOr<Kept> kept = Read(id);
  if (!kept.ok()) return kept.status();
  const Exploration& exploration = kept->objects.exploration;
  FrontierList list;
  absl::Status status = SetFrame(*kept->snapshot, kept->layer->spec().frame_id, frame_id, &list);
  if (!status.ok()) return status;
  if (!IsActive(exploration)) {
    return absl::FailedPreconditionError(
        absl::StrCat("exploration ", exploration.id, " has ended"));
  }
  const absl::StatusOr<Active*> active = Follow(*kept);
  if (!active.ok()) return active.status();
  ExplorationFollower& follower = (*active)->follower;
  list.exploration_id = exploration.id;
  list.frontiers = follower.explorer().ListFrontiers();
  std::stable_sort(list.frontiers.begin(), list.frontiers.end(),
                   [](const auto& a, const auto& b) { return a.cells.size() > b.cells.size(); });
  list.geometry = follower.geometry();
  list.frame_from_floor = list.frame_from_layer * follower.layer_from_floor();
  return list;
}

absl::StatusOr<ExplorationView> ExplorationDesk::Start(const StartOrder& order) {
  MutexLock lock(&mutex_);
  absl::StatusOr<std::optional<ExplorationView>> earlier = FindStarted(order);
  if (!earlier.ok()) return earlier.status();
  if (*earlier) return **std::move(earlier);
  return Retried([&] {
    mutex_.AssertHeld();
    return TryStart(order);
  });
}

absl::StatusOr<std::optional<ExplorationView>> ExplorationDesk::FindStarted(
    const StartOrder& order) const {
  if (order.request_id.empty()) return std::nullopt;
  const absl::StatusOr<std::optional<storage::Receipt>> receipt =
      session_->FindReceipt(order.request_id);
  if (!receipt.ok()) return receipt.status();
  if (!*receipt) return std::nullopt;
  const std::vector<ObjectId>& ids = (*receipt)->object_ids;
  if (ids.empty() || ids.back() == 0) {
    return absl::InvalidArgumentError("request_id was used for something else");
  }
  const absl::StatusOr<Kept> kept = Read(ids.back());
  if (!kept.ok()) return kept.status();
  ExplorationView view;
  absl::Status status =
      SetFrame(*kept->snapshot, kept->layer->spec().frame_id, order.frame_id, &view);
  if (!status.ok()) return status;
  view.revision = (*receipt)->revision;
  // The state at the start: the exploration may have ended since.
  view.objects.exploration = kept->objects.exploration;
  view.objects.exploration.state = ExplorationState::kActive;
  view.objects.exploration.end_reason = EndReason::kNone;
  view.objects.exploration.ended.reset();
  return view;
}

absl::StatusOr<ExplorationDesk::Trial> ExplorationDesk::Try(const Snapshot& snapshot,
                                                            const EditBatch& batch) const {
  const absl::StatusOr<AppliedBatch> applied = Apply(snapshot, batch);
  if (!applied.ok()) return applied.status();
  const absl::StatusOr<std::shared_ptr<const SemanticLayer>> layer = FindLayer(*applied->snapshot);
  if (!layer.ok()) return layer.status();
  absl::StatusOr<std::vector<ExplorationObjects>> all = ReadExplorations(**layer);
  if (!all.ok()) return all.status();
  const auto num_active = std::count_if(
      all->begin(), all->end(), [](const auto& objects) { return IsActive(objects.exploration); });
  if (num_active > static_cast<ptrdiff_t>(kMaxActive)) return TooManyActive();
  // The newest exploration comes first: it is the one that `batch` puts.
  Trial trial{std::move(all->front()), std::make_unique<Active>(max_cells_)};
  ExplorationFollower& follower = trial.active->follower;
  absl::Status status = follower.Follow(*applied->snapshot, trial.objects);
  if (!status.ok()) return status;
  const Explorer::Progress cells = follower.explorer().progress();
  if (cells.explored + cells.reachable + cells.unreachable > 0) return trial;
  return absl::FailedPreconditionError(absl::StrCat("there is no floor of layer \"",
                                                    trial.objects.exploration.occupancy_layer,
                                                    "\" in the area"));
}

absl::StatusOr<ExplorationView> ExplorationDesk::TryStart(const StartOrder& order) {
  const SnapshotPtr snapshot = session_->snapshot();
  const absl::StatusOr<std::shared_ptr<const SemanticLayer>> layer = FindLayer(*snapshot);
  if (!layer.ok()) return layer.status();
  ExplorationView view;
  absl::Status status =
      SetFrame(*snapshot, FrameOf(layer->get(), *snapshot), order.frame_id, &view);
  if (!status.ok()) return status;
  absl::StatusOr<EditBatch> batch = StartBatch(*snapshot, order, session_->options().clock());
  if (!batch.ok()) return batch.status();
  if (*layer != nullptr) {
    batch->if_layers = {{kExplorationsLayer, snapshot->LayerVersionOf(kExplorationsLayer)}};
  }
  absl::StatusOr<Trial> trial = Try(*snapshot, *batch);
  if (!trial.ok()) return trial.status();
  view.num_edits = static_cast<int64_t>(batch->edits.size());
  const absl::StatusOr<storage::Receipt> receipt =
      session_->SubmitAndWait({*std::move(batch), order.author, order.request_id});
  // Another call has created one of the layers meanwhile: ABORTED makes Retried try again.
  if (absl::IsAlreadyExists(receipt.status())) {
    return absl::AbortedError(receipt.status().message());
  }
  if (!receipt.ok()) return receipt.status();
  view.revision = receipt->revision;
  view.objects = std::move(trial->objects);
  view.objects.exploration.id = receipt->object_ids.back();
  active_[view.objects.exploration.id] = std::move(trial->active);
  return view;
}

absl::StatusOr<ExplorationView> ExplorationDesk::Stop(ObjectId id, const std::string& author) {
  MutexLock lock(&mutex_);
  return Retried([&] {
    mutex_.AssertHeld();
    return TryStop(id, author);
  });
}

absl::StatusOr<ExplorationView> ExplorationDesk::TryStop(ObjectId id, const std::string& author) {
  absl::StatusOr<Kept> kept = Read(id);
  if (!kept.ok()) return kept.status();
  ExplorationView view;
  absl::Status status = SetFrame(*kept->snapshot, kept->layer->spec().frame_id, "", &view);
  if (!status.ok()) return status;
  if (IsActive(kept->objects.exploration)) {
    std::optional<ExplorationProgress> progress;
    if (active_.contains(kept->objects.exploration.id)) {
      const absl::StatusOr<ExplorationProgress> measured = Progress(*kept);
      if (measured.ok()) progress = *measured;
    }
    std::vector<Edit> edits;
    End(EndReason::kStopped, &*kept, &edits);
    view.num_edits = static_cast<int64_t>(edits.size());
    const absl::StatusOr<storage::Receipt> receipt = Commit(*kept, std::move(edits), author);
    if (!receipt.ok()) return receipt.status();
    view.revision = receipt->revision;
    active_.erase(kept->objects.exploration.id);
    if (progress) Remember(kept->objects.exploration.id, *progress);
  }
  view.objects = std::move(kept->objects);
  return view;
}

void ExplorationDesk::End(EndReason reason, Kept* kept, std::vector<Edit>* edits) const {
  Exploration& exploration = kept->objects.exploration;
  exploration.state = ExplorationState::kEnded;
  exploration.end_reason = reason;
  exploration.ended = session_->options().clock();
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
