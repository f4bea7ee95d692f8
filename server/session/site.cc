#include "server/session/site.h"

#include <optional>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_spec.h"
#include "server/session/same_request.h"

namespace hypermap::server {
namespace {

absl::Status OfMap(const std::string& map, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat("map \"", map, "\": ", status.message()));
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
  for (const std::string& name : names) site->OpenMap(name);
  return site;
}

Site::Site(std::unique_ptr<storage::MapStore> store, const SessionOptions& options)
    : store_(std::move(store)), options_(options) {}

Site::~Site() { Close(); }

void Site::OpenMap(const std::string& name) {
  // The map is for all callers, also if the one who had it opened has gone.
  const ScopedCancellation to_the_end(nullptr);
  Entry entry{name, nullptr, absl::OkStatus()};
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> stored = store_->Open(name);
  if (stored.ok()) {
    absl::StatusOr<std::unique_ptr<MapSession>> session =
        MapSession::Start(*std::move(stored), options_);
    entry.problem = session.status();
    if (session.ok()) entry.session = *std::move(session);
  } else {
    entry.problem = stored.status();
  }
  // A map whose creation was not completed has been removed.
  if (absl::IsNotFound(entry.problem)) return;
  MutexLock lock(&mutex_);
  maps_.insert_or_assign(name, std::move(entry));
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

absl::StatusOr<std::shared_ptr<MapSession>> Site::CreateBy(const NewMap& map, Start start,
                                                           Check check) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", map.name));
  HYPERMAP_RETURN_IF_ERROR(ValidateFrameId("frame_id", map.frame_id));
  HYPERMAP_RETURN_IF_ERROR(Reserve(map.name));
  const absl::Cleanup release = [&] { Release(map.name); };

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
  HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<MapSession> session, start());
  MutexLock lock(&mutex_);
  maps_[map.name] = {map.name, session, absl::OkStatus()};
  return session;
}

absl::StatusOr<std::shared_ptr<MapSession>> Site::StartNew(const NewMap& map, bool provisional) {
  const ScopedCancellation to_the_end(nullptr);
  storage::MapHeader header{map.name, map.frame_id, options_.clock->Now(), map.request_id};
  header.provisional = provisional;
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::StoredMap> stored, store_->Create(header));
  absl::StatusOr<std::unique_ptr<MapSession>> session =
      MapSession::Start(std::move(stored), options_);
  if (session.ok()) return *std::move(session);
  const absl::Status removed = store_->Delete(map.name, /*request_id=*/"");
  if (removed.ok()) return session.status();
  return absl::Status(session.status().code(),
                      absl::StrCat(session.status().message(),
                                   " (and the new map stays: ", removed.message(), ")"));
}

absl::StatusOr<std::shared_ptr<MapSession>> Site::StartFilled(const NewMap& map, Fill fill) {
  HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<MapSession> session,
                            StartNew(map, /*provisional=*/true));
  const absl::Status status = fill(*session);
  const bool is_complete = status.ok() && session->snapshot()->revision > 0;
  if (is_complete) return session;
  session->Close();
  session.reset();
  const absl::Status removed = store_->Delete(map.name, /*request_id=*/"");
  if (!removed.ok()) {
    return absl::Status(
        status.ok() ? removed.code() : status.code(),
        absl::StrCat(status.message(), " (and the new map stays: ", removed.message(), ")"));
  }
  if (!status.ok()) return status;
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

absl::Status Site::DeleteReserved(const std::string& map, const std::string& request_id,
                                  uint64_t incarnation) {
  std::shared_ptr<MapSession> session;
  {
    MutexLock lock(&mutex_);
    const auto it = maps_.find(map);
    if (it == maps_.end()) {
      return absl::NotFoundError(absl::StrCat("there is no map \"", map, "\""));
    }
    HYPERMAP_RETURN_IF_ERROR(CheckIncarnation(WithProblem(it->second), incarnation));
    session = std::move(it->second.session);
    maps_.erase(it);
  }
  // Answers the accepted submissions. Calls that hold a snapshot keep it.
  if (session) session->Close();
  absl::Status status = store_->Delete(map, request_id);
  if (!status.ok()) OpenMap(map);
  return status;
}

void Site::Close() {
  std::vector<std::shared_ptr<MapSession>> sessions;
  {
    MutexLock lock(&mutex_);
    for (const auto& [name, entry] : maps_) sessions.push_back(entry.session);
  }
  for (const auto& session : sessions) {
    if (session) session->Close();
  }
}

}  // namespace hypermap::server
