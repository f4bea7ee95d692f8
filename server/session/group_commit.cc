#include "server/session/group_commit.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "absl/strings/str_join.h"

namespace hypermap::server {

GroupCommit::GroupCommit(storage::StoredMap* stored, MapFusion* fusion, SnapshotPtr base)
    : stored_(stored), fusion_(fusion), base_(std::move(base)), tip_(base_) {}

void GroupCommit::Add(Submission submission, absl::Time time, ReceiptCallback done) {
  EndRun();
  submission.batch.time = time;
  AddGuarded(submission.author, submission.request_id, time, std::move(done),
             [&] { return fusion_->Edit(*tip_, submission.batch); });
}

void GroupCommit::Add(FusionSubmission submission, absl::Time time, ReceiptCallback done) {
  EndRun();
  AddGuarded(submission.author, submission.request_id, time, std::move(done),
             [&] { return fusion_->Run(*tip_, submission.command); });
}

void GroupCommit::Add(ObservationSubmission submission, absl::Time time, VerdictsCallback done) {
  if (run_ && run_->layer != submission.layer) EndRun();
  absl::StatusOr<std::vector<ObservationVerdict>> verdicts =
      fusion_->Admit(*tip_, submission.layer, submission.observations, time);
  const bool accepted =
      verdicts.ok() && std::any_of(verdicts->begin(), verdicts->end(), [](const auto& verdict) {
        return verdict.outcome == ObservationOutcome::kAccepted;
      });
  if (accepted) {
    if (!run_) run_ = Run{submission.layer, {}, time, pending_.size()};
    run_->authors.insert(std::move(submission.author));
  }
  pending_.push_back(PendingVerdicts{std::move(done), std::move(verdicts)});
}

void GroupCommit::EndRun() {
  if (!run_) return;
  const Run run = *std::exchange(run_, std::nullopt);
  absl::StatusOr<FusionStep> step = fusion_->FoldAdmitted(*tip_, run.layer);
  if (!step.ok()) return;  // fusion is broken, and all of the group fails
  Commit(*std::move(step), absl::StrJoin(run.authors, ", "), run.time, "");
  for (size_t i = run.first_pending; i < pending_.size(); ++i) {
    auto& pending = std::get<PendingVerdicts>(pending_[i]);
    if (!pending.answer.ok()) continue;
    for (ObservationVerdict& verdict : *pending.answer) {
      if (verdict.outcome == ObservationOutcome::kAccepted) verdict.revision = tip_->revision;
    }
  }
}

void GroupCommit::AddGuarded(const std::string& author, const std::string& request_id,
                             absl::Time time, ReceiptCallback done, JudgeFunction judge) {
  if (!request_id.empty()) {
    absl::StatusOr<std::optional<storage::Receipt>> earlier = stored_->FindReceipt(request_id);
    if (!earlier.ok()) {
      pending_.push_back(PendingReceipt{std::move(done), earlier.status(), false});
      return;
    }
    if (*earlier) {
      pending_.push_back(PendingReceipt{std::move(done), **std::move(earlier), false});
      return;
    }
  }
  absl::StatusOr<storage::Receipt> answer = Judge(author, request_id, time, judge);
  pending_.push_back(PendingReceipt{std::move(done), std::move(answer), !commits_.empty()});
}

absl::StatusOr<storage::Receipt> GroupCommit::Judge(const std::string& author,
                                                    const std::string& request_id, absl::Time time,
                                                    JudgeFunction judge) {
  if (!request_id.empty()) {
    const auto same = by_request_id_.find(request_id);
    if (same != by_request_id_.end()) return same->second;
  }
  absl::StatusOr<FusionStep> step = judge();
  if (!step.ok()) return step.status();
  // Nothing was to be done.
  if (!step->applied.snapshot) return storage::Receipt{request_id, tip_->revision, {}};
  storage::Receipt receipt{request_id, step->applied.snapshot->revision, step->applied.object_ids};
  if (!receipt.request_id.empty()) by_request_id_.emplace(receipt.request_id, receipt);
  Commit(*std::move(step), author, time, request_id);
  return receipt;
}

void GroupCommit::Commit(FusionStep step, const std::string& author, absl::Time time,
                         const std::string& request_id) {
  tip_ = step.applied.snapshot;
  commits_.push_back({std::move(step.applied), author, time, request_id, std::move(step.changes)});
}

absl::Status GroupCommit::WriteCommits() {
  EndRun();
  if (!fusion_->broken().ok()) return fusion_->broken();
  if (commits_.empty()) return absl::OkStatus();
  return stored_->Write(commits_);
}

absl::Status GroupCommit::Write() {
  absl::Status status = WriteCommits();
  if (status.ok()) {
    fusion_->Written();
    return status;
  }
  tip_ = base_;
  commits_.clear();
  fusion_->Reset().IgnoreError();
  for (auto& pending : pending_) {
    if (auto* receipt = std::get_if<PendingReceipt>(&pending)) {
      if (receipt->needs_write) receipt->answer = status;
    } else {
      std::get<PendingVerdicts>(pending).answer = status;
    }
  }
  return status;
}

std::vector<FeedCommit> GroupCommit::TakeCommits() {
  std::vector<FeedCommit> commits;
  commits.reserve(commits_.size());
  for (storage::Commit& commit : commits_) {
    commits.push_back(
        {commit.applied.snapshot->revision, commit.time, std::move(commit.author),
         std::make_shared<const std::vector<Change>>(std::move(commit.applied.changes)), nullptr});
  }
  commits_.clear();
  return commits;
}

void GroupCommit::Answer() && {
  for (auto& pending : pending_) {
    if (auto* receipt = std::get_if<PendingReceipt>(&pending)) {
      std::move(receipt->done)(std::move(receipt->answer));
      continue;
    }
    auto& verdicts = std::get<PendingVerdicts>(pending);
    if (verdicts.answer.ok()) {
      for (ObservationVerdict& verdict : *verdicts.answer) {
        if (verdict.revision == 0) verdict.revision = tip_->revision;
      }
    }
    std::move(verdicts.done)(std::move(verdicts.answer));
  }
}

}  // namespace hypermap::server
