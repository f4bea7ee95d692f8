#include "server/session/site.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/cancellation/cancellation.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "base/sync/parallel.h"
#include "map/layers/layer_spec.h"
#include "server/fusion/evidence.h"
#include "server/session/not_owner.h"
#include "server/session/same_request.h"

namespace hypermap::server {
namespace {

// Number of maps that are closed at once: each waits for the disk several times.
constexpr size_t kClosingThreads = 8;

absl::Status OfMap(const std::string& map, const absl::Status& status) {
  absl::Status of_map(status.code(), absl::StrCat("map \"", map, "\": ", status.message()));
  status.ForEachPayload(
      [&](absl::string_view type, const absl::Cord& payload) { of_map.SetPayload(type, payload); });
  return of_map;
}

// As MapSession::CheckIncarnation. The incarnation of a map that can't be opened is not known.
absl::Status CheckIncarnation(const Site::Entry& entry, uint64_t expected) {
  if (entry.session) return entry.session->CheckIncarnation(expected);
  if (expected == 0) return absl::OkStatus();
  return absl::AbortedError(absl::StrCat("map \"", entry.name,
                                         "\" can't be opened, so it is not known whether it is the "
                                         "incarnation that the request expects (",
                                         expected, "): ", entry.problem.message()));
}

absl::Status CheckSameFrame(const storage::MapHeader& made, const std::string& frame_id) {
  if (made.frame_id == frame_id) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "request_id \"", made.request_id, "\" was used for another request, which created map \"",
      made.name, "\" with frame_id \"", made.frame_id,
      "\"; choose an id of its own for each request"));
}

// A request that only creates a map stores no receipt: one with its id is another request's, such
// as that of an import which created the map and filled it.
absl::Status CheckNoOtherRequest(MapSession& made, const std::string& request_id) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<storage::Receipt> receipt,
                            made.FindReceipt(request_id));
  return receipt ? CheckSameRequest(*receipt, "") : absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::unique_ptr<Site>> Site::Open(std::unique_ptr<storage::MapStore> store,
                                                 const SessionOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> names, store->List());
  std::unique_ptr<Site> site(new Site(std::move(store), options));
  if (site->placement_) {
    HYPERMAP_RETURN_IF_ERROR(site->StartPlacement());
    return site;
  }
  const auto max_maps = static_cast<size_t>(options.limits.max_maps);
  size_t num_open = 0;
  for (const std::string& name : names) {
    if (max_maps > 0 && num_open >= max_maps) {
      site->ListWithoutRoom(name);
    } else {
      site->OpenMap(name);
      if (site->Find(name).ok()) ++num_open;
    }
  }
  return site;
}

Site::Site(std::unique_ptr<storage::MapStore> store, const SessionOptions& options)
    : store_(std::move(store)), options_(options) {
  const std::string server_id = store_->server_id();
  if (!server_id.empty()) placement_.emplace(server_id);
}

Site::~Site() { Close(); }

void Site::OpenMap(const std::string& name) {
  // The map is for all callers, also if the one who had it opened has gone.
  const ScopedCancellation to_the_end(nullptr);
  Entry entry{name, nullptr, absl::OkStatus()};
  const std::string stamp = store_->FileStamp(name);
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> stored = store_->Open(name);
  if (stored.ok()) {
    absl::StatusOr<std::unique_ptr<MapSession>> session =
        MapSession::Start(*std::move(stored), options_);
    entry.problem = session.status();
    if (session.ok()) entry.session = *std::move(session);
  } else {
    entry.problem = stored.status();
  }
  MutexLock lock(&mutex_);
  PlanRetry(entry, stamp);
  if (absl::IsNotFound(entry.problem)) {
    // A map whose creation was not completed has been removed.
    maps_.erase(name);
  } else {
    maps_.insert_or_assign(name, std::move(entry));
  }
}

void Site::PlanRetry(const Entry& entry, const std::string& stamp) {
  if (entry.problem.ok() || absl::IsNotFound(entry.problem)) {
    if (retries_.erase(entry.name) == 0 || !entry.problem.ok()) return;
    return logging::Log(logging::Level::kInfo, "map is open again", {{"map", entry.name}});
  }
  const auto [it, is_first] = retries_.try_emplace(entry.name);
  Retry& retry = it->second;
  if (!is_first) retry.pause = std::min(2 * retry.pause, kLastPause);
  retry.at = clock().SinceBoot() + retry.pause;
  retry.stamp = absl::IsDataLoss(entry.problem) ? stamp : "";
}

std::optional<std::pair<std::string, Site::Retry>> Site::ReserveMapToReopen() {
  // Which maps to open is planned with the other servers.
  if (placement_) return std::nullopt;
  const MutexLock lock(&mutex_);
  const absl::Duration now = clock().SinceBoot();
  for (auto& [name, retry] : retries_) {
    if (retry.at > now || reserved_.contains(name)) continue;
    // It was deleted, and perhaps made anew; or it is listed for want of room.
    const auto listed = maps_.find(name);
    const bool is_closed = listed != maps_.end() && listed->second.session == nullptr;
    if (!is_closed || without_room_.contains(name)) continue;
    if (options_.limits.max_maps > 0 && !HasRoomToOpen()) return std::nullopt;
    retry.at = now + retry.pause;
    reserved_.insert(name);
    ++num_changing_;
    return std::pair(name, retry);
  }
  return std::nullopt;
}

void Site::ReopenMaps() {
  while (const auto due = ReserveMapToReopen()) {
    const auto& [map, retry] = *due;
    const bool is_unchanged = !retry.stamp.empty() && store_->FileStamp(map) == retry.stamp;
    if (!is_unchanged) OpenMap(map);
    const MutexLock lock(&mutex_);
    --num_changing_;
    reserved_.erase(map);
  }
}

void Site::ListWithoutRoom(const std::string& name) {
  MutexLock lock(&mutex_);
  without_room_.insert(name);
  maps_.insert_or_assign(name, Entry{name, nullptr,
                                     absl::ResourceExhaustedError(absl::StrCat(
                                         "the map is not open, because there are more maps than "
                                         "--max_maps, which is ",
                                         options_.limits.max_maps))});
}

bool Site::HasRoomToOpen() const {
  const auto num_open = std::count_if(maps_.begin(), maps_.end(), [](const auto& named) {
    return named.second.session != nullptr;
  });
  return num_open + num_changing_ < options_.limits.max_maps;
}

std::optional<std::string> Site::ReserveMapToOpen() {
  MutexLock lock(&mutex_);
  auto map = without_room_.begin();
  while (map != without_room_.end() && reserved_.contains(*map)) ++map;
  if (map == without_room_.end() || !HasRoomToOpen()) return std::nullopt;
  std::string name = *map;
  without_room_.erase(map);
  reserved_.insert(name);
  ++num_changing_;
  return name;
}

void Site::OpenMoreMaps() {
  while (const std::optional<std::string> map = ReserveMapToOpen()) {
    OpenMap(*map);
    MutexLock lock(&mutex_);
    --num_changing_;
    reserved_.erase(*map);
  }
}

Site::Entry Site::WithProblem(Entry entry) {
  if (!entry.session) return entry;
  entry.problem = entry.session->problem();
  if (!entry.problem.ok()) entry.session = nullptr;
  return entry;
}

std::vector<Site::Entry> Site::List() const {
  std::vector<Entry> entries;
  MutexLock lock(&mutex_);
  entries.reserve(maps_.size());
  for (const auto& [name, entry] : maps_) entries.push_back(WithProblem(entry));
  return entries;
}

absl::StatusOr<std::shared_ptr<MapSession>> Site::Find(const std::string& map) const {
  MutexLock lock(&mutex_);
  const auto it = maps_.find(map);
  if (it == maps_.end()) return absl::NotFoundError(absl::StrCat("there is no map \"", map, "\""));
  Entry entry = WithProblem(it->second);
  if (!entry.problem.ok()) return OfMap(map, entry.problem);
  return std::move(entry.session);
}

absl::Status Site::CheckOwner(const std::string& map) const {
  const absl::StatusOr<std::shared_ptr<MapSession>> session = Find(map);
  if (session.ok()) return (*session)->CheckOwner();
  // Other problems are told by what the request asks for.
  return OwnerAddressOf(session.status()) ? session.status() : absl::OkStatus();
}

absl::Status Site::Reserve(const std::string& map) {
  MutexLock lock(&mutex_);
  if (reserved_.insert(map).second) return absl::OkStatus();
  return absl::AbortedError(absl::StrCat("map \"", map, "\" is being made or deleted"));
}

void Site::Release(const std::string& map) {
  MutexLock lock(&mutex_);
  reserved_.erase(map);
}

absl::StatusOr<std::shared_ptr<MapSession>> Site::Create(const NewMap& map) {
  return CreateBy(
      map, [&] { return StartNew(map, /*provisional=*/false); },
      [&](MapSession& made) { return CheckNoOtherRequest(made, map.request_id); });
}

absl::StatusOr<std::shared_ptr<MapSession>> Site::CreateFilled(const NewMap& map, Fill fill) {
  return CreateBy(
      map, [&] { return StartFilled(map, fill); }, [](MapSession&) { return absl::OkStatus(); });
}

absl::Status Site::OpenAgain(const std::string& name) {
  const auto problem = [&] {
    const MutexLock lock(&mutex_);
    const auto entry = maps_.find(name);
    if (entry == maps_.end() || entry->second.session || without_room_.contains(name)) {
      return absl::OkStatus();
    }
    return entry->second.problem;
  };
  const auto may_pass = [](const absl::Status& status) {
    return absl::IsUnavailable(status) || absl::IsResourceExhausted(status);
  };
  // A file on a disk that was made read-only can't be told from one that is no map.
  const absl::Status before = problem();
  if (!may_pass(before) && !absl::IsFailedPrecondition(before)) return absl::OkStatus();
  OpenMap(name);
  const absl::Status after = problem();
  return may_pass(after) ? after : absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<MapSession>> Site::CreateBy(const NewMap& map, Start start,
                                                           Check check) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", map.name));
  HYPERMAP_RETURN_IF_ERROR(ValidateFrameId("frame_id", map.frame_id));
  HYPERMAP_RETURN_IF_ERROR(Reserve(map.name));
  const absl::Cleanup release = [&] { Release(map.name); };

  HYPERMAP_RETURN_IF_ERROR(OpenAgain(map.name));
  if (auto existing = Find(map.name); !absl::IsNotFound(existing.status())) {
    const bool same_id = existing.ok() && !map.request_id.empty() &&
                         (*existing)->header().request_id == map.request_id;
    if (!same_id) {
      return absl::AlreadyExistsError(absl::StrCat("there already is a map \"", map.name, "\""));
    }
    HYPERMAP_RETURN_IF_ERROR(CheckSameFrame((*existing)->header(), map.frame_id));
    HYPERMAP_RETURN_IF_ERROR(check(**existing));
    return existing;
  }
  HYPERMAP_RETURN_IF_ERROR(BeginCreation(map.name));
  absl::StatusOr<std::shared_ptr<MapSession>> session = start();
  // A map that is left although its creation has failed must not stay unknown. One that exists
  // without being listed is of somebody who has put a file into the folder.
  if (!session.ok() && !absl::IsAlreadyExists(session.status())) OpenMap(map.name);
  MutexLock lock(&mutex_);
  --num_changing_;
  if (session.ok()) maps_[map.name] = {map.name, *session, absl::OkStatus()};
  return session;
}

absl::Status Site::BeginCreation(const std::string& map) {
  MutexLock lock(&mutex_);
  const int num_maps = static_cast<int>(maps_.size()) + num_changing_;
  const int max_maps = options_.limits.max_maps;
  if (max_maps > 0 && num_maps >= max_maps) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "map \"", map, "\" is one too many: there are ", num_maps, ", --max_maps is ", max_maps));
  }
  ++num_changing_;
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<MapSession>> Site::StartNew(const NewMap& map, bool provisional) {
  const ScopedCancellation to_the_end(nullptr);
  storage::MapHeader header{map.name, map.frame_id, options_.clock->Now(), map.request_id};
  header.provisional = provisional;
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::StoredMap> stored, store_->Create(header));
  absl::StatusOr<std::unique_ptr<MapSession>> session =
      MapSession::Start(std::move(stored), options_);
  if (session.ok()) return *std::move(session);
  return RemoveIncomplete(map.name, session.status());
}

absl::Status Site::RemoveIncomplete(const std::string& map, const absl::Status& status) {
  const absl::Status removed = store_->Discard(map);
  if (removed.ok()) return status;
  return absl::Status(status.ok() ? removed.code() : status.code(),
                      absl::StrCat(status.message(), status.ok() ? "" : "; and ",
                                   "the new map can't be removed: ", removed.message()));
}

absl::StatusOr<std::shared_ptr<MapSession>> Site::StartFilled(const NewMap& map, Fill fill) {
  HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<MapSession> session,
                            StartNew(map, /*provisional=*/true));
  const absl::Status status = fill(*session);
  const bool is_complete = status.ok() && session->snapshot()->revision > 0;
  if (is_complete) return session;
  session->Close();
  session.reset();
  HYPERMAP_RETURN_IF_ERROR(RemoveIncomplete(map.name, status));
  // There was nothing to fill it with.
  return StartNew(map, /*provisional=*/false);
}

absl::Status Site::Delete(const std::string& map, const std::string& request_id,
                          uint64_t incarnation) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", map));
  HYPERMAP_RETURN_IF_ERROR(Reserve(map));
  const absl::Cleanup release = [&] { Release(map); };

  if (!request_id.empty()) {
    // A retry of a deletion must not delete a map that was created under the name since, nor say
    // that it is gone.
    HYPERMAP_ASSIGN_OR_RETURN(const std::optional<std::string> earlier,
                              store_->FindDeletion(request_id));
    if (earlier == map) return CheckGone(map, request_id);
    if (earlier) {
      return absl::InvalidArgumentError(
          absl::StrCat("request_id was used to delete map \"", *earlier, "\""));
    }
  }
  return DeleteReserved(map, request_id, incarnation);
}

absl::Status Site::CheckGone(const std::string& map, const std::string& request_id) const {
  MutexLock lock(&mutex_);
  if (!maps_.contains(map)) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("request_id \"", request_id, "\" deleted an earlier map \"", map,
                   "\"; the present one was made since and is not deleted"));
}

absl::StatusOr<bool> Site::TakeOut(const std::string& map, uint64_t incarnation,
                                   const absl::Status& meanwhile) {
  std::shared_ptr<MapSession> session;
  bool was_without_room = false;
  {
    MutexLock lock(&mutex_);
    const auto it = maps_.find(map);
    if (it == maps_.end()) {
      return absl::NotFoundError(absl::StrCat("there is no map \"", map, "\""));
    }
    HYPERMAP_RETURN_IF_ERROR(CheckIncarnation(WithProblem(it->second), incarnation));
    session = std::move(it->second.session);
    retries_.erase(map);
    if (meanwhile.ok()) {
      maps_.erase(it);
    } else {
      it->second = {map, nullptr, meanwhile};
    }
    was_without_room = without_room_.erase(map) > 0;
    ++num_changing_;
  }
  // Answers the accepted submissions. Calls that hold a snapshot keep it.
  if (session) {
    session->Close(meanwhile.ok() ? MapSession::NextOwner::kAnyServer
                                  : MapSession::NextOwner::kThisServer);
  }
  return was_without_room;
}

void Site::PutBack(const std::string& map, bool without_room) {
  if (without_room) {
    ListWithoutRoom(map);
  } else {
    OpenMap(map);
  }
  MutexLock lock(&mutex_);
  --num_changing_;
}

absl::Status Site::DeleteReserved(const std::string& map, const std::string& request_id,
                                  uint64_t incarnation) {
  HYPERMAP_ASSIGN_OR_RETURN(const bool was_without_room,
                            TakeOut(map, incarnation, absl::OkStatus()));
  absl::Status status = store_->Delete(map, request_id);
  if (status.ok()) {
    MutexLock lock(&mutex_);
    --num_changing_;
  } else {
    PutBack(map, was_without_room);
  }
  OpenMoreMaps();
  return status;
}

absl::StatusOr<StoreComparison> Site::CompareWithStore(const MapSession& session) {
  const SnapshotPtr shown = session.snapshot();
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<storage::StoredMap> stored,
                            store_->Follow(session.header().name));
  HYPERMAP_RETURN_IF_ERROR(session.CheckIncarnation(stored->header().incarnation));
  return server::CompareWithStore(*shown, *stored);
}

absl::Status Site::LoadAgain(const std::string& map, uint64_t incarnation) {
  HYPERMAP_RETURN_IF_ERROR(Reserve(map));
  const absl::Cleanup release = [&] { Release(map); };
  HYPERMAP_ASSIGN_OR_RETURN(
      const bool was_without_room,
      TakeOut(map, incarnation, absl::UnavailableError("the map is being loaded again")));
  if (!placement_) {
    PutBack(map, was_without_room);
    return absl::OkStatus();
  }
  // Who owns it by then is planned with the other servers.
  const MutexLock lock(&mutex_);
  --num_changing_;
  if (placing_) placing_->Wake();
  return absl::OkStatus();
}

absl::StatusOr<CheckReport> Site::CheckFile(const std::string& path) {
  return store_->CheckFile(path, CheckBy(options_.fusion.codec));
}

absl::StatusOr<std::shared_ptr<MapSession>> Site::Restore(const Restoration& restoration) {
  const std::string& map = restoration.map;
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", map));
  HYPERMAP_RETURN_IF_ERROR(Reserve(map));
  const absl::Cleanup release = [&] { Release(map); };

  auto existing = Find(map);
  const bool exists = !absl::IsNotFound(existing.status());
  const bool same_id = existing.ok() && !restoration.request_id.empty() &&
                       (*existing)->header().request_id == restoration.request_id;
  if (same_id) return existing;
  if (exists && !restoration.replace) {
    return absl::AlreadyExistsError(absl::StrCat("there already is a map \"", map, "\""));
  }
  if (!exists && restoration.incarnation != 0) {
    return absl::AbortedError(absl::StrCat("there is no map \"", map,
                                           "\", but the request expects its incarnation ",
                                           restoration.incarnation));
  }
  bool without_room = false;
  if (exists) {
    // UNAVAILABLE, so that its clients come again.
    HYPERMAP_ASSIGN_OR_RETURN(without_room,
                              TakeOut(map, restoration.incarnation,
                                      absl::UnavailableError("it is being replaced by a backup")));
  } else {
    HYPERMAP_RETURN_IF_ERROR(BeginCreation(map));
  }
  // The replacement that was begun is carried out, also if the caller has gone.
  const ScopedCancellation to_the_end(nullptr);
  const absl::Status status = store_->Restore(restoration.path, map, restoration.request_id);
  // Also after an error: it tells whether the map that was there is still there.
  PutBack(map, without_room);
  HYPERMAP_RETURN_IF_ERROR(status);
  return Find(map);
}

void Site::Close() {
  EndPlacement();
  std::vector<std::shared_ptr<MapSession>> sessions;
  {
    MutexLock lock(&mutex_);
    for (const auto& [name, entry] : maps_) {
      if (entry.session) sessions.push_back(entry.session);
    }
  }
  RunInParallel("hm-closing", kClosingThreads, sessions.size(),
                [&](size_t i) { sessions[i]->Close(); });
}

}  // namespace hypermap::server
