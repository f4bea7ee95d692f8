#include "client_libs/cpp/replica/durable_copy.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "map/edits/difference.h"
#include "storage/geopackage/geopackage_store.h"

namespace hypermap::client {
namespace {

// Prefix of the request id that a replica's file records for its creation; the selection follows.
constexpr absl::string_view kReplica = "replica of ";
// Rows of history that are deleted per step.
constexpr int kCompactRows = 4096;

// Returns whether `before` can be of the same history as `after`.
bool IsSameIncarnation(const KnownRevision& before, const KnownRevision& after) {
  if (before.created_at != after.created_at) return false;
  // A file always has an incarnation, also that of a server that reports none.
  return after.incarnation == 0 || before.incarnation == after.incarnation;
}

// Returns whether `after` is a later state of the map of `before` and can be stored as changes.
// Changes can't delete frames, so all frames of `before` must still exist.
bool LeadsTo(const KnownRevision& before, const KnownRevision& after) {
  if (!IsSameIncarnation(before, after)) return false;
  if (before.snapshot->frame_id != after.snapshot->frame_id) return false;
  if (before.snapshot->revision >= after.snapshot->revision) return false;
  const std::vector<FrameTransform> then = before.snapshot->frames.transforms();
  return std::all_of(then.begin(), then.end(), [&after](const FrameTransform& transform) {
    return after.snapshot->frames.Find(transform.child_frame_id) != nullptr;
  });
}

storage::Commit CommitOf(const KnownRevision& revision, std::vector<Change> changes) {
  storage::Commit commit;
  commit.applied.snapshot = revision.snapshot;
  commit.applied.changes = std::move(changes);
  commit.author = "server";
  commit.time = revision.time;
  return commit;
}

}  // namespace

absl::StatusOr<std::unique_ptr<DurableCopy>> DurableCopy::Open(const std::string& folder,
                                                               const std::string& map,
                                                               const std::string& selection,
                                                               absl::Duration write_delay) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::MapStore> store,
                            storage::OpenGeoPackageStore(folder));
  std::unique_ptr<DurableCopy> copy(
      new DurableCopy(std::move(store), map, absl::StrCat(kReplica, selection), write_delay));
  HYPERMAP_RETURN_IF_ERROR(copy->Load(folder));
  copy->writer_ = std::thread([copy = copy.get()] { copy->Run(); });
  return copy;
}

DurableCopy::DurableCopy(std::unique_ptr<storage::MapStore> store, std::string map,
                         std::string selection, absl::Duration write_delay)
    : store_(std::move(store)),
      map_(std::move(map)),
      selection_(std::move(selection)),
      write_delay_(write_delay) {}

DurableCopy::~DurableCopy() {
  if (!writer_.joinable()) return;
  {
    const MutexLock lock(&mutex_);
    closing_ = true;
  }
  changed_.NotifyAll();
  writer_.join();
  Flush().IgnoreError();
}

absl::Status DurableCopy::Load(const std::string& folder) {
  const MutexLock file_lock(&file_mutex_);
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> file = store_->Open(map_);
  if (absl::IsNotFound(file.status())) return LoadNext();
  absl::Status status = file.status();
  if (status.ok()) {
    file_ = *std::move(file);
    const std::string& request_id = file_->header().request_id;
    if (!absl::StartsWith(request_id, kReplica)) {
      return absl::FailedPreconditionError(
          absl::StrCat(folder, "/", map_, ".gpkg is not the file of a replica"));
    }
    if (request_id != selection_) {
      file_.reset();
      return store_->Delete(map_, "");
    }
    status = ReadStored();
    if (status.ok()) {
      if (stored()) return RemoveMap(next_name());
      // The file was made and not filled.
      file_.reset();
      HYPERMAP_RETURN_IF_ERROR(RemoveMap(map_));
      return LoadNext();
    }
  }
  if (!absl::IsDataLoss(status)) return status;
  file_.reset();
  const std::string path = absl::StrCat(folder, "/", map_, ".gpkg");
  std::error_code error;
  std::filesystem::rename(path, path + ".damaged", error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(path, ": ", error.message()));
}

absl::Status DurableCopy::LoadNext() {
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> next = store_->Open(next_name());
  if (absl::IsNotFound(next.status())) return absl::OkStatus();
  if (next.ok() && (*next)->header().request_id == selection_) {
    file_ = *std::move(next);
    absl::Status status = ReadStored();
    file_.reset();
    if (!status.ok() && !absl::IsDataLoss(status)) return status;
    if (std::optional<KnownRevision> left = stored(); left) {
      auto snapshot = std::make_shared<Snapshot>(*left->snapshot);
      snapshot->map_name = map_;
      left->snapshot = std::move(snapshot);
      HYPERMAP_ASSIGN_OR_RETURN(file_, Make(map_, *left));
      const MutexLock lock(&mutex_);
      stored_ = std::move(left);
    }
  } else if (!next.ok() && !absl::IsDataLoss(next.status())) {
    return next.status();
  }
  next = absl::NotFoundError("closed");
  return RemoveMap(next_name());
}

absl::Status DurableCopy::ReadStored() {
  HYPERMAP_RETURN_IF_ERROR(file_->damage());
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr snapshot, file_->Load());
  HYPERMAP_RETURN_IF_ERROR(snapshot->CheckUndamaged({}));
  const Revision revision = snapshot->revision;
  // The process ended after creating the map and before filling it.
  if (revision == 0) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::HistoryReader> history, file_->OpenHistory());
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::vector<storage::RevisionRecord> made,
      history->Revisions(revision - 1, revision + 1, /*newest_first=*/false, 1));
  if (made.empty()) return absl::DataLossError("the time of the revision is missing");
  const MutexLock lock(&mutex_);
  stored_ = {std::move(snapshot), made.front().time, file_->header().created_at,
             file_->header().incarnation};
  return absl::OkStatus();
}

std::optional<KnownRevision> DurableCopy::stored() const {
  const MutexLock lock(&mutex_);
  return stored_;
}

absl::Status DurableCopy::problem() const {
  const MutexLock lock(&mutex_);
  return problem_;
}

void DurableCopy::Write(KnownRevision newest) {
  {
    const MutexLock lock(&mutex_);
    newest_ = std::move(newest);
    is_due_ = true;
  }
  changed_.NotifyAll();
}

absl::Status DurableCopy::Flush() { return WriteNow(/*all=*/true); }

void DurableCopy::Run() {
  while (AwaitDue()) {
    if (WriteNow(/*all=*/false).ok()) continue;
    const MutexLock lock(&mutex_);
    Delay();
  }
}

bool DurableCopy::AwaitDue() {
  const MutexLock lock(&mutex_);
  while (!closing_ && !is_due_) changed_.Wait(&mutex_);
  Delay();
  return !closing_;
}

void DurableCopy::Delay() {
  const Deadline deadline(write_delay_);
  while (!closing_) {
    const absl::Duration left = deadline.left();
    if (left <= absl::ZeroDuration()) return;
    changed_.WaitFor(&mutex_, left);
  }
}

absl::Status DurableCopy::WriteNow(bool all) {
  const MutexLock file_lock(&file_mutex_);
  std::optional<KnownRevision> before;
  std::optional<KnownRevision> after;
  {
    const MutexLock lock(&mutex_);
    before = stored_;
    after = newest_;
    is_due_ = false;
  }
  if (!after) return absl::OkStatus();
  const absl::StatusOr<bool> written = Store(before, *after, all);
  absl::Status status = written.status();
  if (status.ok()) status = ForgetThePast();
  const MutexLock lock(&mutex_);
  // The file has the revision even if its history could not be deleted.
  if (written.ok() && *written) stored_ = std::move(after);
  if (!file_) stored_.reset();
  if (!status.ok()) is_due_ = true;
  problem_ = std::move(status);
  return file_ ? written.status() : problem_;
}

absl::StatusOr<bool> DurableCopy::Store(const std::optional<KnownRevision>& before,
                                        const KnownRevision& after, bool all) {
  const Revision revision = after.snapshot->revision;
  if (before && before->snapshot->revision == revision && before->time == after.time &&
      IsSameIncarnation(*before, after)) {
    return false;
  }
  absl::Status status = absl::DataLossError("there is no file");
  if (before && LeadsTo(*before, after)) {
    std::vector<Change> changes = Difference(*before->snapshot, *after.snapshot);
    if (changes.empty() && !all) return false;
    const storage::Commit commit = CommitOf(after, std::move(changes));
    status = file_->Write({&commit, 1});
  }
  if (absl::IsDataLoss(status)) status = Replace(after);
  if (!status.ok()) return status;
  forget_before_ = revision;
  return true;
}

absl::Status DurableCopy::Replace(const KnownRevision& newest) {
  // Without a file there is nothing to lose, and the next one may be all that is left.
  if (file_) {
    HYPERMAP_RETURN_IF_ERROR(RemoveMap(next_name()));
    HYPERMAP_RETURN_IF_ERROR(Make(next_name(), newest).status());
  }
  file_.reset();
  HYPERMAP_RETURN_IF_ERROR(RemoveMap(map_));
  HYPERMAP_ASSIGN_OR_RETURN(file_, Make(map_, newest));
  // If it stays, the next opening removes it.
  RemoveMap(next_name()).IgnoreError();
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<storage::StoredMap>> DurableCopy::Make(
    const std::string& name, const KnownRevision& revision) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::StoredMap> file,
                            store_->Create({name, revision.snapshot->frame_id, revision.created_at,
                                            selection_, revision.incarnation}));
  if (revision.snapshot->revision == 0) return file;
  const Snapshot empty;
  const storage::Commit commit = CommitOf(revision, Difference(empty, *revision.snapshot));
  const absl::Status status = file->Write({&commit, 1});
  if (status.ok()) return file;
  // The file holds an empty map, which is not a revision of the server's.
  file.reset();
  RemoveMap(name).IgnoreError();
  return status;
}

absl::Status DurableCopy::RemoveMap(const std::string& name) {
  const absl::Status status = store_->Delete(name, "");
  return absl::IsNotFound(status) ? absl::OkStatus() : status;
}

absl::Status DurableCopy::ForgetThePast() {
  if (!forget_before_) return absl::OkStatus();
  absl::StatusOr<bool> more = true;
  while (more.ok() && *more) {
    more = file_->Compact(*forget_before_, absl::InfinitePast(), kCompactRows);
  }
  if (more.ok()) forget_before_.reset();
  // The next write replaces a file that is lost.
  if (absl::IsDataLoss(more.status())) file_.reset();
  return more.status();
}

}  // namespace hypermap::client
