#include "server/session/group_commit.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "base/status/unless_memory_fails.h"
#include "map/content_bytes.h"
#include "map/edits/batch_cells.h"
#include "map/edits/batch_layers.h"
#include "map/edits/byte_size.h"
#include "map/edits/snapshot_editor.h"
#include "server/session/not_owner.h"
#include "server/session/observation_growth.h"
#include "server/session/same_request.h"

namespace hypermap::server {
namespace {

// The answer to a request whose id has a receipt already.
absl::StatusOr<storage::Receipt> AnswerAgain(const storage::Receipt& receipt,
                                             const std::string& request_digest) {
  HYPERMAP_RETURN_IF_ERROR(CheckSameRequest(receipt, request_digest));
  return receipt;
}

// The bytes of a change. A layer counts as more, because its tables take long to create and to
// remove: a transaction has room for a thousand.
int64_t WeightOf(const Change& change) {
  constexpr int64_t kLayer = int64_t{64} << 10;
  const bool is_layer =
      std::holds_alternative<LayerCreated>(change) || std::holds_alternative<LayerDeleted>(change);
  return ByteSize(change) + (is_layer ? kLayer : 0);
}

bool OnlyRemoves(const EditBatch& batch) {
  return std::all_of(batch.edits.begin(), batch.edits.end(), [](const hypermap::Edit& edit) {
    return std::holds_alternative<DeleteObject>(edit) || std::holds_alternative<DeleteLayer>(edit);
  });
}

// The author of a revision of several authors. It stands in each answer that tells of the revision,
// and so names no more of them than these limits allow.
std::string JoinAuthors(const std::set<std::string>& authors) {
  constexpr size_t kMaxNames = 10;
  constexpr size_t kMaxBytes = 512;
  std::string joined;
  size_t num_names = 0;
  for (const std::string& author : authors) {
    const absl::string_view separator = num_names == 0 ? "" : ", ";
    const size_t bytes = joined.size() + separator.size() + author.size();
    if (num_names == kMaxNames || (num_names > 0 && bytes > kMaxBytes)) {
      absl::StrAppend(&joined, ", and ", authors.size() - num_names, " more");
      break;
    }
    absl::StrAppend(&joined, separator, author);
    ++num_names;
  }
  return joined;
}

}  // namespace

GroupCommit::GroupCommit(storage::StoredMap* stored, MapFusion* fusion, SnapshotPtr base,
                         const Limits& limits, admission::ContentBudget::Share* content)
    : stored_(stored),
      fusion_(fusion),
      base_(std::move(base)),
      limits_(limits),
      content_(content),
      tip_(base_) {}

int64_t GroupCommit::Room() const {
  const int64_t room = content_->room();
  return room == kAnyGrowth ? room : room + taken_ - growth_;
}

absl::Status GroupCommit::Grow(int64_t bytes, bool may_be_refused) {
  const int64_t more = std::max<int64_t>(0, growth_ + bytes - taken_);
  if (may_be_refused) {
    HYPERMAP_RETURN_IF_ERROR(content_->Grow(more));
  } else {
    content_->Add(more);
  }
  taken_ += more;
  growth_ += bytes;
  return absl::OkStatus();
}

void GroupCommit::CountContent() { content_->Add(growth_ - std::exchange(taken_, growth_)); }

template <typename Work>
std::invoke_result_t<Work> GroupCommit::Fuse(const Work& work) {
  bool has_ended = false;
  std::invoke_result_t<Work> result = UnlessMemoryFails([&] {
    std::invoke_result_t<Work> done = work();
    has_ended = true;
    return done;
  });
  // Nobody knows how far the layers have changed.
  if (!has_ended) fusion_->Break(result.status());
  return result;
}

absl::StatusOr<GroupCommit::Step> GroupCommit::Edit(const EditBatch& batch) {
  HYPERMAP_RETURN_IF_ERROR(CheckLayers(*tip_, batch, limits_.max_layers));
  HYPERMAP_ASSIGN_OR_RETURN(AppliedBatch applied, UnlessMemoryFails([&] {
                              return Apply(*tip_, batch, limits_, Room());
                            }));
  const int64_t growth = ContentGrowth(*tip_, *applied.snapshot);
  HYPERMAP_RETURN_IF_ERROR(Grow(growth, /*may_be_refused=*/!OnlyRemoves(batch)));
  absl::StatusOr<FusionReaction> reaction =
      Fuse([&] { return fusion_->React(*tip_, batch, applied); });
  if (reaction.ok() && reaction->parts.empty()) return Step{std::move(applied), {}};
  GiveUp(growth);
  if (!reaction.ok()) return reaction.status();
  // The fused layers have taken account of the batch: giving it up would cost the whole group.
  const ScopedCancellation to_the_end(nullptr);
  return CarryOut(batch, *std::move(reaction), /*may_be_refused=*/false);
}

absl::StatusOr<GroupCommit::Step> GroupCommit::CarryOut(EditBatch batch, FusionReaction reaction,
                                                        bool may_be_refused) {
  if (reaction.parts.empty()) return Step();
  const size_t own = batch.edits.size();
  batch.edits.insert(batch.edits.end(), reaction.edits.begin(), reaction.edits.end());
  Step step;
  if (batch.edits.empty()) {
    // The evidence changed no object, but it has to be stored, and every commit is a revision.
    step.applied = SnapshotEditor(*tip_, tip_->revision + 1).Finish();
  } else {
    absl::StatusOr<AppliedBatch> applied =
        UnlessMemoryFails([&] { return ApplyExtended(*tip_, batch, limits_); });
    if (!applied.ok()) {
      fusion_->GiveUp(applied.status());
      return applied.status();
    }
    step.applied = *std::move(applied);
  }
  const int64_t growth = ContentGrowth(*tip_, *step.applied.snapshot);
  if (absl::Status room = Grow(growth, may_be_refused); !room.ok()) {
    fusion_->GiveUp(room);
    return room;
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
  AddGuarded({submission.author, submission.request_id, submission.request_digest,
              submission.cancellation},
             time, std::move(done), [&] { return Edit(submission.batch); });
}

void GroupCommit::Add(FusionSubmission submission, absl::Time time, ReceiptCallback done) {
  EndRun();
  const ScopedCancellation here(submission.cancellation.get());
  AddGuarded(
      {submission.author, submission.request_id, submission.request_digest,
       submission.cancellation},
      time, std::move(done), [&]() -> absl::StatusOr<Step> {
        HYPERMAP_ASSIGN_OR_RETURN(FusionReaction reaction,
                                  Fuse([&] { return fusion_->Run(*tip_, submission.command); }));
        // A rebuild works on a copy of the layer.
        const bool may_be_refused = std::holds_alternative<RebuildFusion>(submission.command);
        return CarryOut({}, std::move(reaction), may_be_refused);
      });
}

int64_t GroupCommit::MostGrowthOf(const ObservationSubmission& submission) {
  const absl::StatusOr<FusedLayer*> fused = fusion_->Find(*tip_, submission.layer);
  // Admit refuses them.
  if (!fused.ok()) return 0;
  int64_t bytes = MostGrowth(submission, tip_->FindGrid((*fused)->settings().exploration_layer),
                             MaxTiles(limits_.max_cells));
  for (const Observation& observation : submission.observations) {
    bytes += (*fused)->MostGrowth(observation);
  }
  return bytes;
}

void GroupCommit::Add(ObservationSubmission submission, absl::Time time, VerdictsCallback done) {
  // Asked once and before any work: admitted observations are folded together with those of others.
  if (submission.cancellation && submission.cancellation->LookNow()) {
    pending_.push_back(PendingVerdicts{std::move(done), submission.cancellation->status()});
    return;
  }
  if (run_ && run_->layer != submission.layer) EndRun();
  const int64_t most_growth = MostGrowthOf(submission);
  if (absl::Status room = Grow(most_growth, /*may_be_refused=*/true); !room.ok()) {
    pending_.push_back(PendingVerdicts{std::move(done), std::move(room)});
    return;
  }
  absl::StatusOr<std::vector<ObservationVerdict>> verdicts = Fuse([&] {
    return fusion_->Admit(*tip_, submission.layer, submission.observations,
                          submission.judged_at.value_or(time));
  });
  const bool accepted =
      verdicts.ok() && std::any_of(verdicts->begin(), verdicts->end(), [](const auto& verdict) {
        return verdict.outcome == ObservationOutcome::kAccepted;
      });
  if (accepted) {
    if (!run_) run_ = Run{submission.layer, {}, time, pending_.size()};
    run_->authors.insert(std::move(submission.author));
    run_->most_growth += most_growth;
  } else {
    GiveUp(most_growth);
  }
  pending_.push_back(PendingVerdicts{std::move(done), std::move(verdicts)});
}

void GroupCommit::EndRun() {
  if (!run_) return;
  const Run run = *std::exchange(run_, std::nullopt);
  GiveUp(run.most_growth);
  // An error leaves fusion broken, which makes WriteCommits fail the whole group.
  absl::StatusOr<FusionReaction> reaction =
      Fuse([&] { return fusion_->FoldAdmitted(*tip_, run.layer); });
  if (!reaction.ok()) return;
  absl::StatusOr<Step> step = CarryOut({}, *std::move(reaction), /*may_be_refused=*/false);
  if (!step.ok()) return;
  Commit(*std::move(step), {JoinAuthors(run.authors), "", ""}, run.time);
  for (size_t i = run.first_pending; i < pending_.size(); ++i) {
    auto& pending = std::get<PendingVerdicts>(pending_[i]);
    if (!pending.answer.ok()) continue;
    for (ObservationVerdict& verdict : *pending.answer) {
      if (verdict.outcome == ObservationOutcome::kAccepted) verdict.revision = tip_->revision;
    }
  }
}

void GroupCommit::LookUpReceipts(absl::Span<const std::string> request_ids) {
  absl::StatusOr<std::vector<storage::Receipt>> receipts = stored_->FindReceipts(request_ids);
  if (!receipts.ok()) return;
  for (const std::string& request_id : request_ids) looked_up_[request_id];
  for (storage::Receipt& receipt : *receipts) {
    std::string request_id = receipt.request_id;
    looked_up_[std::move(request_id)] = std::move(receipt);
  }
}

absl::StatusOr<std::optional<storage::Receipt>> GroupCommit::FindReceipt(
    const std::string& request_id) const {
  const auto known = looked_up_.find(request_id);
  if (known != looked_up_.end()) return known->second;
  return stored_->FindReceipt(request_id);
}

void GroupCommit::AddGuarded(const Origin& origin, absl::Time time, ReceiptCallback done,
                             JudgeFunction judge) {
  if (absl::Status wanted = CheckCancelled(); !wanted.ok()) {
    pending_.push_back(PendingReceipt{std::move(done), std::move(wanted), false});
    return;
  }
  if (!origin.request_id.empty()) {
    absl::StatusOr<std::optional<storage::Receipt>> earlier = FindReceipt(origin.request_id);
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
  pending_.push_back(
      PendingReceipt{std::move(done), std::move(answer), !commits_.empty(), origin.cancellation});
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
  for (const Change& change : step.applied.changes) bytes_ += WeightOf(change);
  commits_.push_back({std::move(step.applied), origin.author, time, origin.request_id,
                      origin.request_digest, std::move(step.fusion_changes)});
}

absl::Status GroupCommit::WriteCommits() {
  EndRun();
  if (!fusion_->broken().ok()) return fusion_->broken();
  // Refusals are answers, too, which an owner that was replaced must not give.
  if (commits_.empty()) return stored_->ConfirmOwnership();
  // After a write that was given up, fused layers would have to be loaded again, which may take
  // longer than the write.
  std::optional<Cancellation> cancellation;
  if (!fusion_->has_loaded_layers()) cancellation.emplace([this] { return CheckWanted(); });
  const ScopedCancellation here(cancellation ? &*cancellation : Cancellation::Current());
  written_ = stored_->Write(commits_);
  return *written_;
}

absl::Status GroupCommit::CheckWanted() const {
  absl::Status status;
  for (const auto& pending : pending_) {
    const auto* receipt = std::get_if<PendingReceipt>(&pending);
    if (receipt == nullptr) return absl::OkStatus();
    if (!receipt->needs_write) continue;
    if (receipt->cancellation == nullptr || !receipt->cancellation->IsCancelled()) {
      return absl::OkStatus();
    }
    status = receipt->cancellation->status();
  }
  return status;
}

absl::Status GroupCommit::Write() {
  absl::Status status = WriteCommits();
  if (status.ok()) {
    fusion_->Written();
    return status;
  }
  tip_ = base_;
  commits_.clear();
  growth_ = 0;
  // A failure leaves fusion broken; the next group meets the error again.
  fusion_->Reset().IgnoreError();
  const absl::Status owned = stored_->ConfirmOwnership();
  for (auto& pending : pending_) {
    if (auto* receipt = std::get_if<PendingReceipt>(&pending)) {
      if (receipt->needs_write) receipt->answer = ForCaller(status);
      if (!owned.ok()) receipt->answer = ForCaller(owned);
    } else {
      std::get<PendingVerdicts>(pending).answer = ForCaller(status);
    }
  }
  return status;
}

absl::Status GroupCommit::ForCaller(const absl::Status& status) const {
  return ToldToCallers(stored_->header().name, status);
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

std::vector<absl::AnyInvocable<void() &&>> GroupCommit::TakeAnswers() {
  std::vector<absl::AnyInvocable<void() &&>> answers;
  answers.reserve(pending_.size());
  for (Pending& pending : pending_) {
    answers.emplace_back([pending = std::move(pending), newest = tip_->revision]() mutable {
      Answer(std::move(pending), newest);
    });
  }
  pending_.clear();
  return answers;
}

void GroupCommit::Answer(Pending pending, Revision newest) {
  if (auto* receipt = std::get_if<PendingReceipt>(&pending)) {
    std::move(receipt->done)(std::move(receipt->answer));
    return;
  }
  auto& verdicts = std::get<PendingVerdicts>(pending);
  if (verdicts.answer.ok()) {
    // Observations that changed nothing, such as duplicates, are covered by the newest revision.
    for (ObservationVerdict& verdict : *verdicts.answer) {
      if (verdict.revision == 0) verdict.revision = newest;
    }
  }
  std::move(verdicts.done)(std::move(verdicts.answer));
}

}  // namespace hypermap::server
