#include "server/session/map_session.h"

#include <future>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

namespace hypermap::server {

absl::StatusOr<std::unique_ptr<MapSession>> MapSession::Start(
    std::unique_ptr<storage::StoredMap> stored, const SessionOptions& options) {
  absl::StatusOr<SnapshotPtr> snapshot = stored->Load();
  if (!snapshot.ok()) return snapshot.status();
  return std::unique_ptr<MapSession>(
      new MapSession(std::move(stored), *std::move(snapshot), options));
}

MapSession::MapSession(std::unique_ptr<storage::StoredMap> stored, SnapshotPtr snapshot,
                       const SessionOptions& options)
    : options_(options),
      header_(stored->header()),
      stored_(std::move(stored)),
      snapshot_(std::move(snapshot)),
      writer_([this] { RunWriter(); }) {}

MapSession::~MapSession() { Close(); }

SnapshotPtr MapSession::snapshot() const {
  MutexLock lock(&snapshot_mutex_);
  return snapshot_;
}

absl::Status MapSession::CheckAccepts(size_t queued) const {
  if (closing_)
    return absl::UnavailableError(absl::StrCat("map \"", header_.name, "\" is closing"));
  if (queued < static_cast<size_t>(options_.max_queue)) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("map \"", header_.name, "\" has ", queued,
                                                   " requests waiting, --max_queue is ",
                                                   options_.max_queue));
}

void MapSession::Submit(Submission submission, ReceiptCallback done) {
  absl::Status accepted;
  {
    MutexLock lock(&queue_mutex_);
    accepted = CheckAccepts(queue_.batches.size());
    if (accepted.ok()) {
      queue_.batches.push_back({std::move(submission), std::move(done)});
      queue_changed_.NotifyOne();
    }
  }
  if (!accepted.ok()) std::move(done)(std::move(accepted));
}

absl::StatusOr<storage::Receipt> MapSession::SubmitAndWait(Submission submission) {
  // Shared: the waiter may be gone before set_value returns.
  auto promise = std::make_shared<std::promise<absl::StatusOr<storage::Receipt>>>();
  Submit(std::move(submission), [promise](absl::StatusOr<storage::Receipt> receipt) {
    promise->set_value(std::move(receipt));
  });
  return promise->get_future().get();
}

absl::Status MapSession::BackupTo(const std::string& path) {
  auto promise = std::make_shared<std::promise<absl::Status>>();
  {
    MutexLock lock(&queue_mutex_);
    if (absl::Status status = CheckAccepts(queue_.backups.size()); !status.ok()) return status;
    queue_.backups.push_back(
        {path, [promise](absl::Status status) { promise->set_value(std::move(status)); }});
    queue_changed_.NotifyOne();
  }
  return promise->get_future().get();
}

void MapSession::Close() {
  {
    MutexLock lock(&queue_mutex_);
    closing_ = true;
    queue_changed_.NotifyOne();
  }
  if (writer_.joinable()) writer_.join();
  stored_.reset();
}

void MapSession::RunWriter() {
  for (Work work = TakeWork(); !work.empty(); work = TakeWork()) {
    Commit(std::move(work.batches));
    for (QueuedBackup& backup : work.backups) {
      std::move(backup.done)(stored_->BackupTo(backup.path));
    }
  }
}

MapSession::Work MapSession::TakeWork() {
  MutexLock lock(&queue_mutex_);
  while (queue_.empty() && !closing_) queue_changed_.Wait(&queue_mutex_);
  return std::exchange(queue_, Work());
}

void MapSession::Commit(std::vector<QueuedBatch> batches) {
  if (batches.empty()) return;
  GroupCommit group(stored_.get(), snapshot(), options_.edit_limits);
  for (QueuedBatch& batch : batches) {
    group.Add(std::move(batch.submission), absl::Now(), std::move(batch.done));
  }
  // A failure is in the answers of those it concerns.
  group.Write().IgnoreError();
  {
    MutexLock lock(&snapshot_mutex_);
    snapshot_ = group.snapshot();
  }
  std::move(group).Answer();
}

}  // namespace hypermap::server
