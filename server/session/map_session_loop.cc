// The part of MapSession that its loop runs: the writer of a map, or the follower of one that
// another server writes.
#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/logging/log.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "map/content_bytes.h"
#include "server/session/map_session.h"
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

}  // namespace

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
  meters_.SetFoldWork(fusion_->work());
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
