// The part of Site that shares its maps with other servers.
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "base/cancellation/cancellation.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "base/sync/parallel.h"
#include "base/sync/steady_time.h"
#include "server/session/site.h"

namespace hypermap::server {
namespace {

// Longest time between two looks at the store.
constexpr absl::Duration kPause = absl::Seconds(1);
// Number of maps that are opened at once: each waits for the database several times, and all maps
// of a server that has died are to be written again soon.
constexpr size_t kPlacingThreads = 8;
// Longest wait for the last commits of a session, which are in the store.
constexpr absl::Duration kCatchUp = absl::Seconds(5);

const char* NameOf(Placement::Action action) {
  switch (action) {
    case Placement::Action::kOwn:
      return "own";
    case Placement::Action::kFollow:
      return "follow";
    case Placement::Action::kForget:
      return "forget";
    case Placement::Action::kRenew:
      return "renew";
    case Placement::Action::kKeep:
      break;
  }
  return "keep";
}

}  // namespace

absl::Status Site::StartPlacement() {
  HYPERMAP_ASSIGN_OR_RETURN(read_index_, ReadIndex::Start(store_.get(), options_.executor));
  Reconcile();
  const auto step = [this]() -> std::optional<absl::Duration> {
    {
      const MutexLock lock(&mutex_);
      if (is_closing_) return std::nullopt;
    }
    return Reconcile();
  };
  {
    const MutexLock lock(&mutex_);
    HYPERMAP_ASSIGN_OR_RETURN(placing_, options_.executor->Start("hm-placement", step));
  }
  store_->ListenForChanges([this](const std::string& map) { HearOfChange(map); });
  return absl::OkStatus();
}

void Site::EndPlacement() {
  if (!placement_) return;
  if (read_index_) read_index_->Close();
  store_->ListenForChanges(nullptr);
  std::unique_ptr<Executor::Running> placing;
  {
    const MutexLock lock(&mutex_);
    is_closing_ = true;
    placing = std::move(placing_);
  }
  if (!placing) return;
  placing->Wake();
  placing->Join();
}

void Site::AskNewest(const std::string& map, ReadIndex::Callback done) const {
  if (read_index_) return read_index_->Ask(map, std::move(done));
  const absl::StatusOr<std::shared_ptr<MapSession>> session = Find(map);
  if (!session.ok()) return std::move(done)(session.status());
  std::move(done)(
      storage::NewestRevision{(*session)->incarnation(), (*session)->snapshot()->revision});
}

void Site::HearOfChange(const std::string& map) {
  std::shared_ptr<MapSession> session;
  {
    const MutexLock lock(&mutex_);
    const auto entry = maps_.find(map);
    if (entry != maps_.end()) session = entry->second.session;
    // Also for a map that was made by another server.
    if (entry == maps_.end() && placing_) placing_->Wake();
  }
  if (session && session->is_follower()) session->LookForRevisions();
}

std::vector<Placement::Listed> Site::ListForPlacement() const {
  std::vector<Placement::Listed> listed;
  const MutexLock lock(&mutex_);
  for (const auto& [name, stored] : maps_) {
    const MapSession* const session = stored.session.get();
    if (session == nullptr) {
      listed.push_back({name});
    } else {
      listed.push_back({name, session->problem().ok(), session->is_follower(),
                        session->incarnation(), session->snapshot()->revision});
    }
  }
  return listed;
}

absl::Duration Site::Reconcile() {
  const ScopedCancellation to_the_end(nullptr);
  // The list comes first: a map that is made meanwhile is in the survey at most.
  const std::vector<Placement::Listed> listed = ListForPlacement();
  const absl::StatusOr<storage::Survey> survey = store_->TakeSurvey();
  // Without the store nothing can be said of the others. What is open stays open.
  if (!survey.ok()) return kPause;
  const absl::Duration now = clock().SinceBoot();
  std::vector<Placement::Task> changes;
  for (Placement::Task& task : placement_->Plan(*survey, listed, now)) {
    if (task.action == Placement::Action::kKeep) {
      Keep(task);
    } else {
      changes.push_back(std::move(task));
    }
  }
  RunInParallel("hm-placing", kPlacingThreads, changes.size(),
                [&](size_t i) { CarryOut(changes[i]); });
  // The maps of a server that has died are taken as soon as its lease is over.
  const absl::Duration spent = clock().SinceBoot() - now;
  return std::min(kPause, placement_->UntilChange() - spent);
}

void Site::Keep(const Placement::Task& task) {
  const absl::StatusOr<std::shared_ptr<MapSession>> session = Find(task.map);
  if (!session.ok() || !(*session)->is_follower()) return;
  (*session)->SetOwner(task.owner_address);
  const Revision shown = (*session)->snapshot()->revision;
  placement_meters_.NoteLag(task.map, shown, task.revision, SteadyTime::Now());
  if (shown < task.revision) (*session)->LookForRevisions();
}

void Site::CarryOut(const Placement::Task& task) {
  // Another call makes or deletes the map. The next plan sees what came of it.
  if (!Reserve(task.map).ok()) return;
  const absl::Cleanup release = [&] { Release(task.map); };
  switch (task.action) {
    case Placement::Action::kForget:
      return Forget(task.map);
    case Placement::Action::kRenew:
      return Renew(task);
    default:
      return Replace(task);
  }
}

absl::StatusOr<std::unique_ptr<MapSession>> Site::OpenFor(const Placement::Task& task) {
  if (task.action == Placement::Action::kOwn) {
    absl::StatusOr<std::unique_ptr<storage::StoredMap>> stored = store_->Open(task.map);
    // Another server was faster. Callers come again, and find it.
    if (absl::IsFailedPrecondition(stored.status())) {
      return absl::UnavailableError(stored.status().message());
    }
    HYPERMAP_RETURN_IF_ERROR(stored.status());
    return MapSession::Start(*std::move(stored), options_);
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::StoredMap> stored, store_->Follow(task.map));
  return MapSession::Follow(std::move(stored), task.owner_address, options_);
}

void Site::Renew(const Placement::Task& task) {
  // If the store can't be reached, the next plan is the same.
  store_->RenewIncarnation(task.map, task.incarnation, task.revision).IgnoreError();
}

void Site::CloseBroken(const Placement::Task& task) {
  std::shared_ptr<MapSession> broken;
  {
    const MutexLock lock(&mutex_);
    const auto found = maps_.find(task.map);
    if (found == maps_.end() || !found->second.session) return;
    const MapSession& session = *found->second.session;
    const bool is_replaced = !session.is_follower() && session.incarnation() != task.incarnation;
    // One that works was made after the plan.
    if (session.problem().ok() && !is_replaced) return;
    broken = std::move(found->second.session);
    found->second = {task.map, nullptr, absl::UnavailableError("it is being opened again")};
  }
  broken->Close();
}

void Site::HandOver(const Placement::Task& task, MapSession& follower) {
  const absl::StatusOr<std::shared_ptr<MapSession>> owner = Find(task.map);
  if (!owner.ok() || (*owner)->is_follower()) return;
  (*owner)->HandOver(task.owner_address);
  follower.CatchUp((*owner)->snapshot()->revision, kCatchUp);
}

void Site::Replace(const Placement::Task& task) {
  // One that has lost the map still has it open.
  CloseBroken(task);
  absl::StatusOr<std::unique_ptr<MapSession>> session = OpenFor(task);
  if (absl::IsNotFound(session.status())) return;
  if (session.ok() && task.action == Placement::Action::kFollow) HandOver(task, **session);
  // Before the map is shown as owned.
  if (session.ok() && task.action == Placement::Action::kOwn) placement_meters_.AddTakeover();
  std::shared_ptr<MapSession> before;
  {
    const MutexLock lock(&mutex_);
    Entry& entry = maps_[task.map];
    entry.name = task.map;
    // What is shown stays, if nothing better can be.
    if (!session.ok() && entry.session != nullptr && entry.session->problem().ok()) return;
    before = std::move(entry.session);
    entry = {task.map, nullptr, session.status()};
    if (session.ok()) entry.session = *std::move(session);
  }
  logging::Log(logging::Level::kInfo, "map is placed",
               {{"map", task.map}, {"action", NameOf(task.action)}, {"owner", task.owner_address}});
  placement_meters_.ForgetLag(task.map);
  // Writes what waits, and gives the map back.
  if (before) before->Close();
}

void Site::Forget(const std::string& map) {
  placement_meters_.ForgetLag(map);
  const absl::StatusOr<bool> taken = TakeOut(map, /*incarnation=*/0, absl::OkStatus());
  if (!taken.ok()) return;
  const MutexLock lock(&mutex_);
  --num_changing_;
}

}  // namespace hypermap::server
