#include "server/session/group_commit.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "absl/strings/str_join.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "map/edits/byte_size.h"
#include "map/edits/snapshot_editor.h"
#include "server/session/same_request.h"

namespace hypermap::server {
namespace {

// The answer to a request whose id has a receipt already.
absl::StatusOr<storage::Receipt> AnswerAgain(const storage::Receipt& receipt,
                                             const std::string& request_digest) {
  HYPERMAP_RETURN_IF_ERROR(CheckSameRequest(receipt, request_digest));
  return receipt;
}

}  // namespace

GroupCommit::GroupCommit(storage::StoredMap* stored, MapFusion* fusion, SnapshotPtr base,
                         const Limits& limits)
    : stored_(stored), fusion_(fusion), base_(std::move(base)), limits_(limits), tip_(base_) {}

absl::StatusOr<GroupCommit::Step> GroupCommit::Edit(const EditBatch& batch) {
  HYPERMAP_ASSIGN_OR_RETURN(AppliedBatch applied, Apply(*tip_, batch, limits_));
  HYPERMAP_ASSIGN_OR_RETURN(FusionReaction reaction, fusion_->React(*tip_, batch, applied));
  if (reaction.parts.empty()) return Step{std::move(applied), {}};
  // The fused layers have taken account of the batch: giving it up would cost the whole group.
  const ScopedCancellation to_the_end(nullptr);
  return CarryOut(batch, std::move(reaction));
}

absl::StatusOr<GroupCommit::Step> GroupCommit::CarryOut(EditBatch batch, FusionReaction reaction) {
  if (reaction.parts.empty()) return Step();
  const size_t own = batch.edits.size();
  batch.edits.insert(batch.edits.end(), reaction.edits.begin(), reaction.edits.end());
  Step step;
  if (batch.edits.empty()) {
    // The evidence changed no object, but it has to be stored, and every commit is a revision.
    step.applied = SnapshotEditor(*tip_, tip_->revision + 1).Finish();
  } else {
    absl::StatusOr<AppliedBatch> applied = ApplyExtended(*tip_, batch, limits_);
    if (!applied.ok()) {
      fusion_->GiveUp(applied.status());
      return applied.status();
    }
    step.applied = *std::move(applied);
  }
  // The caller gets the ids of its own edits, fusion those of the reaction's.
  const absl::Span<const ObjectId> ids = step.applied.object_ids;
  step.fusion_changes = fusion_->Finish(reaction, ids.subspan(own));
  step.applied.object_ids.resize(own);
  return step;
}

void GroupCommit::Add(Submission submission, absl::Time time, ReceiptCallback done) {
  // The batch must see the objects of observations that came before it.
  EndRun();
  submission.batch.time = time;
  const ScopedCancellation here(submission.cancellation.get());
  AddGuarded({submission.author, submission.request_id, submission.request_digest}, time,
             std::move(done), [&] { return Edit(submission.batch); });
}

void GroupCommit::Add(FusionSubmission submission, absl::Time time, ReceiptCallback done) {
  EndRun();
  const ScopedCancellation here(submission.cancellation.get());
  AddGuarded({submission.author, submission.request_id, submission.request_digest}, time,
             std::move(done), [&]() -> absl::StatusOr<Step> {
               HYPERMAP_ASSIGN_OR_RETURN(FusionReaction reaction,
                                         fusion_->Run(*tip_, submission.command));
               return CarryOut({}, std::move(reaction));
             });
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
  // An error leaves fusion broken, which makes WriteCommits fail the whole group.
  absl::StatusOr<FusionReaction> reaction = fusion_->FoldAdmitted(*tip_, run.layer);
  if (!reaction.ok()) return;
  absl::StatusOr<Step> step = CarryOut({}, *std::move(reaction));
  if (!step.ok()) return;
  Commit(*std::move(step), {absl::StrJoin(run.authors, ", "), "", ""}, run.time);
  for (size_t i = run.first_pending; i < pending_.size(); ++i) {
    auto& pending = std::get<PendingVerdicts>(pending_[i]);
    if (!pending.answer.ok()) continue;
    for (ObservationVerdict& verdict : *pending.answer) {
      if (verdict.outcome == ObservationOutcome::kAccepted) verdict.revision = tip_->revision;
    }
  }
}

void GroupCommit::AddGuarded(const Origin& origin, absl::Time time, ReceiptCallback done,
                             JudgeFunction judge) {
  if (absl::Status wanted = CheckCancelled(); !wanted.ok()) {
    pending_.push_back(PendingReceipt{std::move(done), std::move(wanted), false});
    return;
  }
  if (!origin.request_id.empty()) {
    absl::StatusOr<std::optional<storage::Receipt>> earlier =
        stored_->FindReceipt(origin.request_id);
    if (!earlier.ok()) {
      pending_.push_back(PendingReceipt{std::move(done), earlier.status(), false});
      return;
    }
    if (*earlier) {
      pending_.push_back(
          PendingReceipt{std::move(done), AnswerAgain(**earlier, origin.request_digest), false});
      return;
    }
  }
  absl::StatusOr<storage::Receipt> answer = Judge(origin, time, judge);
  pending_.push_back(PendingReceipt{std::move(done), std::move(answer), !commits_.empty()});
}

absl::StatusOr<storage::Receipt> GroupCommit::Judge(const Origin& origin, absl::Time time,
                                                    JudgeFunction judge) {
  if (!origin.request_id.empty()) {
    const auto same = by_request_id_.find(origin.request_id);
    if (same != by_request_id_.end()) return AnswerAgain(same->second, origin.request_digest);
  }
  HYPERMAP_ASSIGN_OR_RETURN(Step step, judge());
  // There was nothing to do: no revision is made and no receipt is stored.
  if (!step.applied.snapshot) return storage::Receipt{origin.request_id, tip_->revision, {}, ""};
  storage::Receipt receipt{origin.request_id, step.applied.snapshot->revision,
                           step.applied.object_ids, origin.request_digest};
  if (!receipt.request_id.empty()) by_request_id_.emplace(receipt.request_id, receipt);
  Commit(std::move(step), origin, time);
  return receipt;
}

void GroupCommit::Commit(Step step, const Origin& origin, absl::Time time) {
  tip_ = step.applied.snapshot;
  for (const Change& change : step.applied.changes) bytes_ += ByteSize(change);
  commits_.push_back({std::move(step.applied), origin.author, time, origin.request_id,
                      origin.request_digest, std::move(step.fusion_changes)});
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
  // A failure leaves fusion broken; the next group meets the error again.
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
      // Observations that changed nothing, such as duplicates, are covered by the newest revision.
      for (ObservationVerdict& verdict : *verdicts.answer) {
        if (verdict.revision == 0) verdict.revision = tip_->revision;
      }
    }
    std::move(verdicts.done)(std::move(verdicts.answer));
  }
}

}  // namespace hypermap::server
