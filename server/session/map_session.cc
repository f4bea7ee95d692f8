#include "server/session/map_session.h"

#include <algorithm>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/admission/refusals.h"
#include "base/cancellation/cancellation.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "map/content_bytes.h"
#include "server/fusion/evidence.h"
#include "server/session/awaited_task.h"
#include "server/session/not_owner.h"
#include "server/session/submission_size.h"

namespace hypermap::server {
namespace {

// The time at which the newest revision was made.
absl::StatusOr<absl::Time> NewestCommitTime(storage::StoredMap& stored, Revision newest) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<storage::HistoryReader> reader,
                            stored.OpenHistory());
  HYPERMAP_ASSIGN_OR_RETURN(const auto records,
                            reader->Revisions(newest - 1, newest + 1, false, 1));
  absl::Time time = stored.header().created_at;
  for (const storage::RevisionRecord& record : records) time = std::max(time, record.time);
  return time;
}

// Stamps are judged by the clock of the site, unless there is another.
SessionOptions WithClocksOfFusion(SessionOptions options,
                                  std::function<absl::Time()> commit_clock) {
  if (!options.fusion.clock) {
    options.fusion.clock = [clock = options.clock] { return clock->Now(); };
  }
  options.fusion.commit_clock = std::move(commit_clock);
  return options;
}

}  // namespace

absl::StatusOr<std::unique_ptr<MapSession>> MapSession::Load(
    std::unique_ptr<storage::StoredMap> stored, const SessionOptions& options) {
  for (const std::string& note : stored->opening_notes()) {
    logging::Log(logging::Level::kWarning, "map was not found as it was left",
                 {{"map", stored->header().name}, {"note", note}});
  }
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr snapshot, stored->Load());
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<storage::TimeMark> marks, stored->TimeMarks());
  HYPERMAP_ASSIGN_OR_RETURN(const absl::Time newest_commit,
                            NewestCommitTime(*stored, snapshot->revision));
  std::unique_ptr<MapSession> session(
      new MapSession(std::move(stored), snapshot, std::move(marks), newest_commit, options));
  session->health_.NoteDamage(session->stored_->damage());
  for (const auto& [name, layer] : snapshot->damaged) session->health_.NoteDamage(layer.damage);
  return session;
}

absl::StatusOr<std::unique_ptr<MapSession>> MapSession::Start(
    std::unique_ptr<storage::StoredMap> stored, const SessionOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<MapSession> session, Load(std::move(stored), options));
  HYPERMAP_ASSIGN_OR_RETURN(
      session->fusion_, MapFusion::Open(&session->stored_->fusion_log(), &session->options_.fusion,
                                        session->options_.limits));
  session->late_.emplace(session->fusion_.get(), session->options_.executor);
  HYPERMAP_ASSIGN_OR_RETURN(
      session->writer_,
      options.executor->Start("hm-writer", [writer = session.get()] { return writer->Step(); }));
  return session;
}

absl::StatusOr<std::unique_ptr<MapSession>> MapSession::Follow(
    std::unique_ptr<storage::StoredMap> stored, const std::string& owner,
    const SessionOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<MapSession> session, Load(std::move(stored), options));
  session->follower_.emplace(session->stored_.get());
  session->SetOwner(owner);
  HYPERMAP_ASSIGN_OR_RETURN(session->writer_,
                            options.executor->Start("hm-follower", [follower = session.get()] {
                              return follower->FollowStep();
                            }));
  return session;
}

MapSession::MapSession(std::unique_ptr<storage::StoredMap> stored, const SnapshotPtr& snapshot,
                       std::vector<storage::TimeMark> marks, absl::Time newest_commit,
                       const SessionOptions& options)
    : options_(WithClocksOfFusion(options, [this] { return time_.Now(); })),
      header_(stored->header()),
      stored_(std::move(stored)),
      time_(options_.clock, std::move(marks), newest_commit),
      expiry_(*snapshot, &time_),
      health_(header_.name),
      history_(stored_.get()),
      compaction_(header_.name, stored_.get(), &history_, &time_, options_.limits),
      content_(options_.content, ContentBytes(*snapshot)),
      evidence_(options_.content, 0),
      snapshot_(snapshot),
      feed_(snapshot->revision, StructureOf(*snapshot), options_.feed),
      robots_(options_.limits, options_.clock.get()) {}

MapSession::~MapSession() { Close(); }

absl::Status MapSession::CheckIncarnation(uint64_t expected) const {
  if (expected == 0 || expected == header_.incarnation) return absl::OkStatus();
  return absl::AbortedError(
      absl::StrCat("map \"", header_.name, "\" is another incarnation (", header_.incarnation,
                   ") than the request expects (", expected,
                   "): it was restored, replaced or made anew, and its revisions are others"));
}

void MapSession::SetOwner(std::optional<std::string> address) {
  const MutexLock lock(&queue_mutex_);
  owner_ = std::move(address);
}

absl::Status MapSession::CheckOwner() const {
  const MutexLock lock(&queue_mutex_);
  return owner_ ? NotOwnerError(header_.name, *owner_) : absl::OkStatus();
}

absl::Status MapSession::problem() const {
  MutexLock lock(&queue_mutex_);
  return problem_;
}

MapCondition MapSession::condition() const {
  absl::Status closed = problem();
  return closed.ok() ? health_.condition() : MapCondition{MapState::kClosed, std::move(closed)};
}

SnapshotPtr MapSession::snapshot() const {
  MutexLock lock(&snapshot_mutex_);
  return snapshot_;
}

absl::Status MapSession::CheckAccepts(int64_t queued, int64_t bytes) const {
  if (owner_) return NotOwnerError(header_.name, *owner_);
  if (closing_) {
    return absl::UnavailableError(absl::StrCat("map \"", header_.name, "\" is closing"));
  }
  HYPERMAP_RETURN_IF_ERROR(problem_);
  if (queued >= options_.limits.max_queue) {
    return admission::TryLater(absl::StrCat("map \"", header_.name, "\" has ", queued,
                                            " requests waiting, --max_queue is ",
                                            options_.limits.max_queue));
  }
  const int64_t queued_bytes = queue_.load.all().bytes + late_load_.all().bytes;
  const bool fits =
      bytes == 0 || queued_bytes == 0 || queued_bytes + bytes <= options_.limits.max_queue_bytes;
  if (fits) return absl::OkStatus();
  return admission::TryLater(absl::StrCat(
      "map \"", header_.name, "\" has requests of ", queued_bytes, " bytes waiting, one of ", bytes,
      " bytes is too many, --max_queue_bytes is ", options_.limits.max_queue_bytes));
}

absl::Status MapSession::CheckShare(const std::string& client, int64_t bytes) const {
  QueueLoad::Size waiting = queue_.load.Of(client);
  waiting += late_load_.Of(client);
  // The first submission of a client may have any size, and a place also in a queue of one.
  if (client.empty() || waiting.submissions == 0) return absl::OkStatus();
  const Limits& limits = options_.limits;
  if (waiting.submissions >= limits.max_queue / 2) {
    return admission::TryLater(
        absl::StrCat("map \"", header_.name, "\" has ", waiting.submissions,
                     " requests of one client waiting; one client may fill half of --max_queue, ",
                     limits.max_queue));
  }
  if (waiting.bytes + bytes <= limits.max_queue_bytes / 2) return absl::OkStatus();
  return admission::TryLater(
      absl::StrCat("map \"", header_.name, "\" has requests of ", waiting.bytes,
                   " bytes of one client waiting, one of ", bytes,
                   " bytes is too many; one client may fill half of --max_queue_bytes, ",
                   limits.max_queue_bytes));
}

template <typename SubmissionType, typename Callback>
void MapSession::Enqueue(SubmissionType submission, Callback done) {
  absl::Status accepted;
  const int64_t bytes = ByteSize(submission);
  {
    MutexLock lock(&queue_mutex_);
    accepted = CheckAccepts(queue_.load.all().submissions + late_load_.all().submissions, bytes);
    if (accepted.ok()) accepted = CheckShare(submission.client, bytes);
    if (accepted.ok()) {
      queue_.load.Add(submission.client, bytes);
      queue_.submissions.push_back(
          Queued<SubmissionType, Callback>{std::move(submission), std::move(done)});
      // The writer sleeps only while the queue is empty: later submissions need not wake it.
      if (queue_.submissions.size() == 1) writer_->Wake();
      return;
    }
  }
  std::move(done)(std::move(accepted));
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
  // The writer uses the caller's cancellation while the caller waits.
  submission.cancellation =
      std::shared_ptr<Cancellation>(std::shared_ptr<void>(), Cancellation::Current());
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
  // Shared, because this thread may go on before End has returned.
  auto awaited = std::make_shared<AwaitedTask>();
  {
    MutexLock lock(&queue_mutex_);
    // The caller holds what a task needs: its bytes do not wait in the queue.
    HYPERMAP_RETURN_IF_ERROR(CheckAccepts(static_cast<int64_t>(queue_.tasks.size()), 0));
    // A FunctionRef is enough: the caller waits for a task that has begun.
    queue_.tasks.push_back([awaited, task, caller = Cancellation::Current()] {
      if (!awaited->Begin()) return;
      const ScopedCancellation here(caller);
      absl::Status wanted = CheckCancelled();
      awaited->End(wanted.ok() ? task() : std::move(wanted));
    });
    writer_->Wake();
  }
  return awaited->Await();
}

absl::Status MapSession::BackupTo(const std::string& path,
                                  absl::FunctionRef<absl::Status(int64_t most_bytes)> reserve) {
  std::unique_ptr<storage::MapBackup> backup;
  const absl::Status opened = RunOnWriter([&]() -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(const int64_t most_bytes, stored_->BackupBytes());
    HYPERMAP_RETURN_IF_ERROR(reserve(most_bytes));
    HYPERMAP_ASSIGN_OR_RETURN(backup, stored_->OpenBackup());
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(opened);
  absl::Status written = backup->WriteTo(path);
  if (absl::IsDataLoss(written)) health_.NoteDamage(written);
  return written;
}

absl::StatusOr<CheckReport> MapSession::Check() {
  std::unique_ptr<storage::MapCheck> check;
  const absl::Status opened = RunOnWriter([&]() -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(check, stored_->OpenCheck());
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(opened);
  absl::StatusOr<CheckReport> report = check->Run(CheckBy(options_.fusion.codec));
  if (report.ok() && !report->is_clean()) {
    const Finding& first = report->findings.front();
    const auto num = static_cast<int64_t>(report->findings.size()) + report->more;
    health_.NoteDamage(absl::DataLossError(absl::StrCat(
        "a check has found ", num, num == 1 ? " problem" : " problems", ", the first in ",
        first.table.empty() ? "the file" : first.table, ": ", first.problem)));
  }
  return report;
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

absl::StatusOr<std::optional<storage::FusionBase>> MapSession::ReadEvidenceBase(
    const std::string& layer) {
  absl::StatusOr<std::optional<storage::FusionBase>> base;
  const absl::Status status = RunOnWriter([&] {
    base = stored_->fusion_log().FindBase(layer);
    return base.status();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return base;
}

absl::StatusOr<std::vector<RobotClocks::Robot>> MapSession::ReadRobotClocks() {
  std::vector<RobotClocks::Robot> robots;
  const absl::Status status = RunOnWriter([&] {
    robots = fusion_->robot_clocks().List();
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return robots;
}

QueueLoad::Size MapSession::queue_size() const {
  const MutexLock lock(&queue_mutex_);
  QueueLoad::Size size = queue_.load.all();
  size += late_load_.all();
  return size;
}

void MapSession::HandOver(const std::string& owner) {
  {
    const MutexLock lock(&queue_mutex_);
    owner_ = owner;
    refuses_late_ = true;
  }
  EndLoop();
}

void MapSession::CatchUp(Revision revision, absl::Duration timeout) {
  // Shared, because this thread may go on before set_value has returned.
  auto reached = std::make_shared<std::promise<void>>();
  const ChangeFeed::WaitId id = feed_.Await(revision - 1, [reached] { reached->set_value(); });
  LookForRevisions();
  reached->get_future().wait_for(absl::ToChronoMilliseconds(timeout));
  feed_.Remove(id);
}

void MapSession::LookForRevisions() {
  const MutexLock lock(&queue_mutex_);
  if (writer_ && !closing_) writer_->Wake();
}

void MapSession::EndWaiting() {
  feed_.Close();
  const MutexLock lock(&queue_mutex_);
  refuses_late_ = true;
  if (writer_) writer_->Wake();
}

void MapSession::EndLoop() {
  {
    MutexLock lock(&queue_mutex_);
    closing_ = true;
    if (writer_) writer_->Wake();
  }
  if (writer_) writer_->Join();
  FlushAnswers();
}

void MapSession::FlushAnswers() {
  if (options_.answers != nullptr) options_.answers->Flush();
}

void MapSession::Close(NextOwner next) {
  EndWaiting();
  EndLoop();
  history_.Close();
  fusion_.reset();
  if (follower_) follower_->Close();
  if (stored_ && next == NextOwner::kThisServer) stored_->KeepOwnership();
  stored_.reset();
}

}  // namespace hypermap::server
