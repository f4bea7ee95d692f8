#include "server/session/group_commit.h"

#include <optional>
#include <utility>

namespace hypermap::server {

GroupCommit::GroupCommit(storage::StoredMap* stored, SnapshotPtr base, const EditLimits& limits)
    : stored_(stored), base_(std::move(base)), limits_(limits), tip_(base_) {}

void GroupCommit::Add(Submission submission, absl::Time time, ReceiptCallback done) {
  if (!submission.request_id.empty()) {
    absl::StatusOr<std::optional<storage::Receipt>> earlier =
        stored_->FindReceipt(submission.request_id);
    if (!earlier.ok()) {
      pending_.push_back({std::move(done), earlier.status(), false});
      return;
    }
    if (*earlier) {
      pending_.push_back({std::move(done), **std::move(earlier), false});
      return;
    }
  }
  absl::StatusOr<storage::Receipt> answer = Judge(std::move(submission), time);
  pending_.push_back({std::move(done), std::move(answer), !commits_.empty()});
}

absl::StatusOr<storage::Receipt> GroupCommit::Judge(Submission submission, absl::Time time) {
  if (!submission.request_id.empty()) {
    const auto same = by_request_id_.find(submission.request_id);
    if (same != by_request_id_.end()) return same->second;
  }
  absl::StatusOr<AppliedBatch> applied = Apply(*tip_, submission.batch, limits_);
  if (!applied.ok()) return applied.status();
  storage::Receipt receipt{submission.request_id, applied->snapshot->revision, applied->object_ids};
  if (!receipt.request_id.empty()) by_request_id_.emplace(receipt.request_id, receipt);
  tip_ = applied->snapshot;
  commits_.push_back(
      {*std::move(applied), std::move(submission.author), time, std::move(submission.request_id)});
  return receipt;
}

absl::Status GroupCommit::Write() {
  if (commits_.empty()) return absl::OkStatus();
  absl::Status status = stored_->Write(commits_);
  if (status.ok()) return status;
  tip_ = base_;
  for (Pending& pending : pending_) {
    if (pending.needs_write) pending.answer = status;
  }
  return status;
}

void GroupCommit::Answer() && {
  for (Pending& pending : pending_) std::move(pending.done)(std::move(pending.answer));
}

}  // namespace hypermap::server
