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
  std::unique_ptr<MapSession> session(
      new MapSession(std::move(stored), *std::move(snapshot), options));
  absl::StatusOr<std::unique_ptr<MapFusion>> fusion = MapFusion::Open(
      &session->stored_->fusion_log(), &session->options_.fusion, session->options_.edit_limits);
  if (!fusion.ok()) return fusion.status();
  session->fusion_ = *std::move(fusion);
  session->writer_ = std::thread([writer = session.get()] { writer->RunWriter(); });
  return session;
}

MapSession::MapSession(std::unique_ptr<storage::StoredMap> stored, SnapshotPtr snapshot,
                       const SessionOptions& options)
    : options_(options),
      header_(stored->header()),
      stored_(std::move(stored)),
      snapshot_(std::move(snapshot)) {}

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

template <typename SubmissionType, typename Callback>
void MapSession::Enqueue(SubmissionType submission, Callback done) {
  absl::Status accepted;
  {
    MutexLock lock(&queue_mutex_);
    accepted = CheckAccepts(queue_.submissions.size());
    if (accepted.ok()) {
      queue_.submissions.push_back(
          Queued<SubmissionType, Callback>{std::move(submission), std::move(done)});
      queue_changed_.NotifyOne();
    }
  }
  if (!accepted.ok()) std::move(done)(std::move(accepted));
}

void MapSession::Submit(Submission submission, ReceiptCallback done) {
  Enqueue(std::move(submission), std::move(done));
}

void MapSession::Run(FusionSubmission submission, ReceiptCallback done) {
  Enqueue(std::move(submission), std::move(done));
}

void MapSession::Observe(ObservationSubmission submission, VerdictsCallback done) {
  Enqueue(std::move(submission), std::move(done));
}

template <typename SubmissionType>
absl::StatusOr<storage::Receipt> MapSession::EnqueueAndWait(SubmissionType submission) {
  // Shared: the waiter may be gone before set_value returns.
  auto promise = std::make_shared<std::promise<absl::StatusOr<storage::Receipt>>>();
  Enqueue<SubmissionType, ReceiptCallback>(std::move(submission),
                                           [promise](absl::StatusOr<storage::Receipt> receipt) {
                                             promise->set_value(std::move(receipt));
                                           });
  return promise->get_future().get();
}

absl::StatusOr<storage::Receipt> MapSession::SubmitAndWait(Submission submission) {
  return EnqueueAndWait(std::move(submission));
}

absl::StatusOr<storage::Receipt> MapSession::RunAndWait(FusionSubmission submission) {
  return EnqueueAndWait(std::move(submission));
}

absl::Status MapSession::RunOnWriter(absl::FunctionRef<absl::Status()> task) {
  auto promise = std::make_shared<std::promise<absl::Status>>();
  {
    MutexLock lock(&queue_mutex_);
    if (absl::Status status = CheckAccepts(queue_.tasks.size()); !status.ok()) return status;
    // The task outlives its run: this waits for it.
    queue_.tasks.push_back([promise, task] { promise->set_value(task()); });
    queue_changed_.NotifyOne();
  }
  return promise->get_future().get();
}

absl::Status MapSession::BackupTo(const std::string& path) {
  return RunOnWriter([&] { return stored_->BackupTo(path); });
}

absl::Status MapSession::InspectFusion(const std::string& layer, FusionTask task) {
  return RunOnWriter([&]() -> absl::Status {
    const absl::StatusOr<FusedLayer*> fused = fusion_->Find(*snapshot(), layer);
    return fused.ok() ? task(**fused) : fused.status();
  });
}

absl::StatusOr<std::vector<Evidence>> MapSession::ReadEvidence(const std::string& layer,
                                                               const storage::LogKey& after,
                                                               int max_entries) {
  absl::StatusOr<std::vector<storage::LogEntry>> entries;
  const absl::Status status = RunOnWriter([&] {
    entries = stored_->fusion_log().Read(layer, after, max_entries);
    return entries.status();
  });
  if (!status.ok()) return status;
  std::vector<Evidence> read;
  for (const storage::LogEntry& entry : *entries) {
    absl::StatusOr<Evidence> evidence = DecodeEvidence(entry, options_.fusion.codec);
    if (!evidence.ok()) return evidence.status();
    read.push_back(*std::move(evidence));
  }
  return read;
}

void MapSession::Close() {
  {
    MutexLock lock(&queue_mutex_);
    closing_ = true;
    queue_changed_.NotifyOne();
  }
  if (writer_.joinable()) writer_.join();
  fusion_.reset();
  stored_.reset();
}

void MapSession::RunWriter() {
  for (Work work = TakeWork(); !work.empty(); work = TakeWork()) {
    Commit(std::move(work.submissions));
    for (Task& task : work.tasks) std::move(task)();
  }
  fusion_->KeepCheckpoints();
}

MapSession::Work MapSession::TakeWork() {
  MutexLock lock(&queue_mutex_);
  while (queue_.empty() && !closing_) queue_changed_.Wait(&queue_mutex_);
  return std::exchange(queue_, Work());
}

void MapSession::Commit(std::vector<QueuedSubmission> submissions) {
  if (submissions.empty()) return;
  GroupCommit group(stored_.get(), fusion_.get(), snapshot());
  for (QueuedSubmission& queued : submissions) {
    std::visit(
        [&group](auto& q) { group.Add(std::move(q.submission), absl::Now(), std::move(q.done)); },
        queued);
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
