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
#include "base/sync/steady_time.h"
#include "map/content_bytes.h"
#include "server/fusion/evidence.h"
#include "server/session/awaited_task.h"
#include "server/session/not_owner.h"
#include "server/session/submission_size.h"
#include "storage/ownership.h"

namespace hypermap::server {
namespace {

// Longest time that the writer sleeps before it reads the clocks again. The wall clock may be set
// at any time, and the machine be suspended, which no timer notices.
constexpr absl::Duration kMaxWait = absl::Minutes(1);
// Number of expired objects that one commit removes, so that edits do not wait long behind it.
constexpr size_t kMaxExpiredPerCommit = 1000;
constexpr absl::Duration kExpiryRetry = absl::Seconds(1);
// Number of groups that are written for each step of compaction while the queue never empties:
// compaction must not fall behind for ever, and must not take much of the writer's time.
constexpr int kGroupsPerCompactionStep = 8;
// Number of submissions whose receipts are looked up with one question. A group may end before it
// has taken them.
constexpr size_t kLookedUpTogether = 100;
// Time until a follower that could not read asks the store again.
constexpr absl::Duration kFollowRetry = absl::Milliseconds(500);
// Longest time that the writer folds late observations in advance before it looks for other work.
// While other work waits, it takes as long as the commits before.
constexpr absl::Duration kMaxLateWork = absl::Milliseconds(50);

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

void MapSession::Close(NextOwner next) {
  EndWaiting();
  EndLoop();
  history_.Close();
  fusion_.reset();
  if (follower_) follower_->Close();
  if (stored_ && next == NextOwner::kThisServer) stored_->KeepOwnership();
  stored_.reset();
}

std::optional<absl::Duration> MapSession::Step() {
  std::optional<std::vector<QueuedSubmission>> submissions = TakeSubmissions();
  if (!submissions) {
    EndWriting();
    return std::nullopt;
  }
  // With submissions, the commit looks at the files.
  if (submissions->empty()) CheckFiles();
  const SteadyTime start = options_.executor->Now();
  Commit(*std::move(submissions));
  last_commit_took_ = options_.executor->Now() - start;
  RunTasks();
  MaintainMap();
  WorkOnLate();
  return UntilNextStep();
}

std::optional<absl::Duration> MapSession::FollowStep() {
  {
    const MutexLock lock(&queue_mutex_);
    if (closing_) return std::nullopt;
  }
  if (is_broken_) return kMaxWait;
  absl::StatusOr<MapFollower::Steps> steps = follower_->Read(snapshot());
  if (absl::IsOutOfRange(steps.status()) || absl::IsDataLoss(steps.status())) {
    EndFollowing(steps.status());
    return kMaxWait;
  }
  if (!steps.ok()) return kFollowRetry;
  if (steps->commits.empty()) return kMaxWait;
  content_.Add(ContentGrowth(*snapshot(), *steps->snapshot));
  Publish(steps->snapshot, std::move(steps->commits));
  feed_.Wake();
  return absl::ZeroDuration();
}

void MapSession::EndFollowing(const absl::Status& reason) {
  is_broken_ = true;
  logging::Log(logging::Level::kWarning, "map has to be loaded again",
               {{"map", header_.name}, {"reason", reason.ToString()}});
  {
    const MutexLock lock(&queue_mutex_);
    problem_ = absl::UnavailableError(absl::StrCat("it is being loaded again: ", reason.message()));
  }
  feed_.Close();
}

void MapSession::LookForRevisions() {
  const MutexLock lock(&queue_mutex_);
  if (writer_ && !closing_) writer_->Wake();
}

void MapSession::EndWriting() {
  RefuseLate();
  if (is_broken_) return;
  // So that the next start need not fold long logs again.
  fusion_->KeepCheckpoints();
  KeepMark(time_.MarkForRestart(snapshot()->revision, /*closing=*/true));
}

absl::Duration MapSession::UntilNextStep() const {
  {
    const MutexLock lock(&queue_mutex_);
    if (!queue_.empty() || closing_) return absl::ZeroDuration();
  }
  return std::min({UntilMaintenance(), late_->UntilWork(), kMaxWait});
}

std::optional<std::vector<MapSession::QueuedSubmission>> MapSession::TakeSubmissions() {
  const MutexLock lock(&queue_mutex_);
  if (queue_.empty() && closing_) return std::nullopt;
  queue_.load = QueueLoad();
  return std::exchange(queue_.submissions, {});
}

void MapSession::RunTasks() {
  std::vector<Task> tasks;
  {
    const MutexLock lock(&queue_mutex_);
    tasks.swap(queue_.tasks);
  }
  for (Task& task : tasks) std::move(task)();
}

void MapSession::KeepMark(const std::optional<storage::TimeMark>& mark) {
  if (!mark) return;
  // No age that a limit names needs marks from before it.
  const absl::Duration age = std::max(options_.limits.history_age, options_.limits.receipt_age);
  const absl::Duration forget_before = mark->passed - age;
  const absl::Status status = stored_->AddTimeMark(*mark, forget_before);
  if (status.ok()) {
    time_.MarkIsStored(forget_before);
    mark_failed_ = false;
    return;
  }
  time_.MarkIsLost();
  // While the disk is full, each commit tries again.
  if (std::exchange(mark_failed_, true)) return;
  logging::Log(logging::Level::kWarning, "the time of a map can't be stored",
               {{"map", header_.name}, {"problem", status.ToString()}});
}

void MapSession::Commit(std::vector<QueuedSubmission> submissions) {
  for (size_t next = 0; next < submissions.size();) {
    if (next > 0) RunTasks();
    if (!is_broken_) KeepMark(time_.MarkBeforeCommit(snapshot()->revision));
    GroupCommit group(stored_.get(), fusion_.get(), snapshot(), options_.limits, &content_);
    const SteadyTime end_of_group = options_.executor->Now() + options_.max_group_time;
    const size_t first = next;
    do {
      if ((next - first) % kLookedUpTogether == 0) {
        LookUpReceipts(absl::MakeConstSpan(submissions).subspan(next, kLookedUpTogether), &group);
      }
      auto* observations =
          std::get_if<Queued<ObservationSubmission, VerdictsCallback>>(&submissions[next]);
      if (observations == nullptr || !SetAside(*observations)) {
        std::visit(
            [&](auto& q) {
              group.Add(std::move(q.submission), time_.NextCommit(), std::move(q.done));
            },
            submissions[next]);
      }
      ++next;
    } while (next < submissions.size() && group.bytes() < options_.max_group_bytes &&
             options_.executor->Now() < end_of_group);
    Finish(group);
  }
}

void MapSession::LookUpReceipts(absl::Span<const QueuedSubmission> submissions,
                                GroupCommit* group) {
  std::vector<std::string> request_ids;
  for (const QueuedSubmission& queued : submissions) {
    if (const auto* edit = std::get_if<Queued<Submission, ReceiptCallback>>(&queued)) {
      request_ids.push_back(edit->submission.request_id);
    }
  }
  std::erase(request_ids, "");
  // A single one is asked for when its turn comes.
  if (request_ids.size() > 1) group->LookUpReceipts(request_ids);
}

bool MapSession::SetAside(Queued<ObservationSubmission, VerdictsCallback>& queued) {
  queued.submission.judged_at = options_.fusion.clock();
  LateObservations::Waiting waiting{std::move(queued.submission), std::move(queued.done), 0};
  waiting.bytes = ByteSize(waiting.submission);
  const int64_t bytes = waiting.bytes;
  const std::string client = waiting.submission.client;
  if (late_->TakeIfLate(*snapshot(), waiting)) {
    const MutexLock lock(&queue_mutex_);
    late_load_.Add(client, bytes);
    return true;
  }
  queued = {std::move(waiting.submission), std::move(waiting.done)};
  return false;
}

void MapSession::RefuseLate() {
  for (LateObservations::Waiting& waiting : late_->TakeAll()) {
    {
      const MutexLock lock(&queue_mutex_);
      late_load_.Remove(waiting.submission.client, waiting.bytes);
    }
    std::move(waiting.done)(
        absl::UnavailableError(absl::StrCat("map \"", header_.name, "\" is closing")));
  }
}

void MapSession::WorkOnLate() {
  if (late_->empty()) return;
  bool refuses = false;
  {
    const MutexLock lock(&queue_mutex_);
    refuses = refuses_late_;
  }
  if (refuses) return RefuseLate();
  const SteadyTime start = options_.executor->Now();
  std::vector<LateObservations::Waiting> ready = late_->Work(*snapshot(), [&] {
    const absl::Duration passed = options_.executor->Now() - start;
    if (passed >= kMaxLateWork) return true;
    if (passed < last_commit_took_) return false;
    const MutexLock lock(&queue_mutex_);
    return refuses_late_ || !queue_.empty();
  });
  evidence_.Add(fusion_->bytes() - evidence_.bytes());
  if (ready.empty()) return;
  {
    const MutexLock lock(&queue_mutex_);
    for (const auto& waiting : ready) late_load_.Remove(waiting.submission.client, waiting.bytes);
  }
  if (!is_broken_) KeepMark(time_.MarkBeforeCommit(snapshot()->revision));
  GroupCommit group(stored_.get(), fusion_.get(), snapshot(), options_.limits, &content_);
  for (LateObservations::Waiting& waiting : ready) {
    group.Add(std::move(waiting.submission), time_.NextCommit(), std::move(waiting.done));
  }
  Finish(group);
}

void MapSession::Finish(GroupCommit& group) {
  // The answers of the submissions contain the error.
  if (!group.Write().ok()) {
    meters_.AddFailedGroup();
    CheckFiles();
  }
  if (group.stored()) NoteWrite(*group.stored());
  group.CountContent();
  evidence_.Add(fusion_->bytes() - evidence_.bytes());
  // Before the answers, so that a caller that has its answer finds the revision published.
  Publish(group.snapshot(), group.TakeCommits());
  Answer(group);
  // After the snapshot, so that a call that waited for a revision finds it published; and after the
  // answers, because many calls may wait.
  feed_.Wake();
}

bool MapSession::HasSubmissions() const {
  const MutexLock lock(&queue_mutex_);
  return !queue_.submissions.empty();
}

void MapSession::Answer(GroupCommit& group) {
  std::vector<Answers::Give> answers = group.TakeAnswers();
  auto next = answers.begin();
  const auto may_answer = [&] {
    return options_.answers == nullptr || (num_unanswered_ == 0 && !HasSubmissions());
  };
  for (; next != answers.end() && may_answer(); ++next) std::move (*next)();
  if (next == answers.end()) return;
  answers.erase(answers.begin(), next);
  ++num_unanswered_;
  options_.answers->Add([this, rest = std::move(answers)]() mutable {
    for (Answers::Give& answer : rest) std::move(answer)();
    --num_unanswered_;
  });
}

void MapSession::FlushAnswers() {
  if (options_.answers != nullptr) options_.answers->Flush();
}

void MapSession::Publish(const SnapshotPtr& snapshot, std::vector<FeedCommit> commits) {
  {
    MutexLock lock(&snapshot_mutex_);
    snapshot_ = snapshot;
  }
  int64_t changes = 0;
  for (const FeedCommit& commit : commits) {
    expiry_.Update(*commit.changes);
    changes += static_cast<int64_t>(commit.changes->size());
  }
  meters_.AddGroup(static_cast<int64_t>(commits.size()), changes);
  feed_.Append(std::move(commits));
}

QueueLoad::Size MapSession::queue_size() const {
  const MutexLock lock(&queue_mutex_);
  QueueLoad::Size size = queue_.load.all();
  size += late_load_.all();
  return size;
}

absl::Duration MapSession::UntilExpiry() const {
  return std::max(expiry_.next() - time_.Lived(), expire_not_before_ - time_.Passed());
}

absl::Duration MapSession::UntilMaintenance() const {
  if (is_broken_) return absl::InfiniteDuration();
  const absl::Duration next = std::min(compaction_.next(), health_.next_trial());
  return std::min(UntilExpiry(), next - time_.Passed());
}

void MapSession::CheckFiles() {
  if (is_broken_) return;
  const absl::Status status = stored_->CheckFile();
  if (!absl::IsDataLoss(status)) return;
  is_broken_ = true;
  // That it has another owner happens after each failover.
  logging::Log(storage::IsLostOwnership(status) ? logging::Level::kWarning : logging::Level::kError,
               "map is closed", {{"map", header_.name}, {"problem", status.ToString()}});
  {
    MutexLock lock(&queue_mutex_);
    problem_ = ToldToCallers(header_.name, status);
  }
  // Watches end; their clients are told the reason when they ask again.
  feed_.Close();
}

void MapSession::NoteWrite(const absl::Status& written) {
  // If the files were replaced, the map is closed.
  if (!is_broken_) health_.NoteWrite(written, time_.Passed());
}

void MapSession::MaintainMap() {
  bool idle = false;
  {
    MutexLock lock(&queue_mutex_);
    if (closing_) return;
    idle = queue_.submissions.empty();
  }
  if (is_broken_) return;
  time_.ReadClocks();
  KeepMark(time_.MarkForRestart(snapshot()->revision, /*closing=*/false));
  if (health_.next_trial() <= time_.Passed()) NoteWrite(stored_->TryWrite());
  if (UntilExpiry() <= absl::ZeroDuration()) RemoveExpired();
  const Revision newest = snapshot()->revision;
  if (!compaction_.IsDue(newest)) return;
  if (!idle && ++groups_since_compaction_ < kGroupsPerCompactionStep) return;
  groups_since_compaction_ = 0;
  compaction_.Step(newest, fusion_.get());
}

void MapSession::RemoveExpired() {
  Submission submission{expiry_.Due(time_.Lived(), kMaxExpiredPerCommit), kExpiryAuthor, ""};
  const auto done = [&](const absl::StatusOr<storage::Receipt>& receipt) {
    if (receipt.ok()) return;
    // The objects stay until the next attempt.
    logging::Log(logging::Level::kWarning, "objects can't be removed when their time has come",
                 {{"map", header_.name}, {"problem", receipt.status().ToString()}});
    expire_not_before_ = time_.Passed() + kExpiryRetry;
  };
  std::vector<QueuedSubmission> submissions;
  submissions.push_back(Queued<Submission, ReceiptCallback>{std::move(submission), done});
  Commit(std::move(submissions));
  // What `done` uses is this thread's.
  FlushAnswers();
}

}  // namespace hypermap::server
