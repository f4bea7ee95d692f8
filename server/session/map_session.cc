#include "server/session/map_session.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <future>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/watch/structure.h"

namespace hypermap::server {
namespace {

// Longest time that the writer sleeps before it reads the clock again. The clock may be set at any
// time, which no timer notices.
constexpr absl::Duration kMaxWait = absl::Minutes(1);
// Number of expired objects that one commit removes, so that edits do not wait long behind it.
constexpr size_t kMaxExpiredPerCommit = 1000;
constexpr absl::Duration kExpiryRetry = absl::Seconds(1);
constexpr char kExpiryAuthor[] = "expiry";
// Number of groups that are written for each step of compaction while the queue never empties:
// compaction must not fall behind for ever, and must not take much of the writer's time.
constexpr int kGroupsPerCompactionStep = 8;

}  // namespace

absl::StatusOr<std::unique_ptr<MapSession>> MapSession::Start(
    std::unique_ptr<storage::StoredMap> stored, const SessionOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr snapshot, stored->Load());
  std::unique_ptr<MapSession> session(
      new MapSession(std::move(stored), std::move(snapshot), options));
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<MapFusion> fusion,
                            MapFusion::Open(&session->stored_->fusion_log(),
                                            &session->options_.fusion, session->options_.limits));
  session->fusion_ = std::move(fusion);
  HYPERMAP_RETURN_IF_ERROR(session->LoadLastCommitTime());
  session->writer_ = std::thread([writer = session.get()] { writer->RunWriter(); });
  return session;
}

MapSession::MapSession(std::unique_ptr<storage::StoredMap> stored, SnapshotPtr snapshot,
                       const SessionOptions& options)
    : options_(options),
      header_(stored->header()),
      stored_(std::move(stored)),
      last_commit_time_(header_.created_at),
      expiry_(*snapshot),
      history_(stored_.get()),
      compaction_(header_.name, stored_.get(), &history_, options_.limits),
      snapshot_(snapshot),
      feed_(snapshot->revision, StructureOf(*snapshot), options_.feed) {}

absl::Status MapSession::LoadLastCommitTime() {
  HYPERMAP_ASSIGN_OR_RETURN(HistoryPool::Lease reader, history_.Take());
  const Revision newest = snapshot()->revision;
  HYPERMAP_ASSIGN_OR_RETURN(const auto records,
                            reader->Revisions(newest - 1, newest + 1, false, 1));
  for (const storage::RevisionRecord& record : records) {
    last_commit_time_ = std::max(last_commit_time_, record.time);
  }
  return absl::OkStatus();
}

MapSession::~MapSession() { Close(); }

SnapshotPtr MapSession::snapshot() const {
  MutexLock lock(&snapshot_mutex_);
  return snapshot_;
}

absl::Status MapSession::CheckAccepts(size_t queued) const {
  if (closing_)
    return absl::UnavailableError(absl::StrCat("map \"", header_.name, "\" is closing"));
  if (queued < static_cast<size_t>(options_.limits.max_queue)) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("map \"", header_.name, "\" has ", queued,
                                                   " requests waiting, --max_queue is ",
                                                   options_.limits.max_queue));
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
      // The writer sleeps only while the queue is empty: later submissions need not wake it.
      if (queue_.submissions.size() == 1) queue_changed_.NotifyOne();
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
  // Shared with the callback, because this thread may go on before set_value has returned.
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
    HYPERMAP_RETURN_IF_ERROR(CheckAccepts(queue_.tasks.size()));
    // A FunctionRef is enough: the caller's function lives until this returns, after the run.
    queue_.tasks.push_back([promise, task] { promise->set_value(task()); });
    queue_changed_.NotifyOne();
  }
  return promise->get_future().get();
}

absl::Status MapSession::BackupTo(const std::string& path) {
  return RunOnWriter([&] { return stored_->BackupTo(path); });
}

absl::StatusOr<std::optional<storage::Receipt>> MapSession::FindReceipt(
    const std::string& request_id) {
  absl::StatusOr<std::optional<storage::Receipt>> receipt;
  absl::Status status = RunOnWriter([&] {
    receipt = stored_->FindReceipt(request_id);
    return receipt.status();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return receipt;
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
  HYPERMAP_RETURN_IF_ERROR(status);
  std::vector<Evidence> read;
  for (const storage::LogEntry& entry : *entries) {
    HYPERMAP_ASSIGN_OR_RETURN(Evidence evidence, DecodeEvidence(entry, options_.fusion.codec));
    read.push_back(std::move(evidence));
  }
  return read;
}

void MapSession::LookAtClock() {
  MutexLock lock(&queue_mutex_);
  looks_at_clock_ = true;
  queue_changed_.NotifyOne();
}

void MapSession::Close() {
  // First, so that watches and calls that wait for a revision end while the writer finishes.
  feed_.Close();
  {
    MutexLock lock(&queue_mutex_);
    closing_ = true;
    queue_changed_.NotifyOne();
  }
  if (writer_.joinable()) writer_.join();
  history_.Close();
  fusion_.reset();
  stored_.reset();
}

void MapSession::RunWriter() {
  while (std::optional<Work> work = TakeWork()) {
    Commit(std::move(work->submissions));
    for (Task& task : work->tasks) std::move(task)();
    MaintainMap();
  }
  // So that the next start need not fold long logs again.
  fusion_->KeepCheckpoints();
}

std::optional<MapSession::Work> MapSession::TakeWork() {
  const absl::Duration wait = NextMaintenance() - options_.clock();
  MutexLock lock(&queue_mutex_);
  // Without a loop: after a spurious wake-up the work is empty and maintenance finds nothing due.
  if (queue_.empty() && !closing_ && !looks_at_clock_ && wait > absl::ZeroDuration()) {
    queue_changed_.WaitFor(&queue_mutex_, std::min(wait, kMaxWait));
  }
  looks_at_clock_ = false;
  if (queue_.empty() && closing_) return std::nullopt;
  return std::exchange(queue_, Work());
}

absl::Time MapSession::CommitTime() {
  last_commit_time_ = std::max(last_commit_time_, options_.clock());
  return last_commit_time_;
}

void MapSession::Commit(std::vector<QueuedSubmission> submissions) {
  if (submissions.empty()) return;
  GroupCommit group(stored_.get(), fusion_.get(), snapshot(), options_.limits);
  for (QueuedSubmission& queued : submissions) {
    std::visit(
        [&](auto& q) { group.Add(std::move(q.submission), CommitTime(), std::move(q.done)); },
        queued);
  }
  // The answers of the submissions contain the error.
  group.Write().IgnoreError();
  {
    MutexLock lock(&snapshot_mutex_);
    snapshot_ = group.snapshot();
  }
  std::vector<FeedCommit> commits = group.TakeCommits();
  for (const FeedCommit& commit : commits) expiry_.Update(*commit.changes);
  // After the snapshot, so that a call that waited for a revision finds it published.
  feed_.Append(std::move(commits));
  std::move(group).Answer();
}

absl::Time MapSession::NextMaintenance() const {
  return std::min(std::max(expiry_.next(), expire_not_before_), compaction_.next());
}

void MapSession::MaintainMap() {
  bool idle = false;
  {
    MutexLock lock(&queue_mutex_);
    if (closing_) return;
    idle = queue_.submissions.empty();
  }
  const absl::Time now = options_.clock();
  if (std::max(expiry_.next(), expire_not_before_) <= now) RemoveExpired(now);
  const Revision newest = snapshot()->revision;
  if (!compaction_.IsDue(newest, now)) return;
  if (!idle && ++groups_since_compaction_ < kGroupsPerCompactionStep) return;
  groups_since_compaction_ = 0;
  compaction_.Step(newest, now);
}

void MapSession::RemoveExpired(absl::Time now) {
  Submission submission{expiry_.Due(now, kMaxExpiredPerCommit), kExpiryAuthor, ""};
  const auto done = [&](const absl::StatusOr<storage::Receipt>& receipt) {
    if (receipt.ok()) return;
    // The objects stay until the next attempt.
    spdlog::warn("objects can't be removed when their time has come map={} problem={}",
                 header_.name, receipt.status().ToString());
    expire_not_before_ = now + kExpiryRetry;
  };
  std::vector<QueuedSubmission> submissions;
  submissions.push_back(Queued<Submission, ReceiptCallback>{std::move(submission), done});
  Commit(std::move(submissions));
}

}  // namespace hypermap::server
