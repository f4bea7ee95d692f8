// Group commit: batches, observations and fusion commands that are stored in one transaction.
#ifndef HYPERMAP_SERVER_SESSION_GROUP_COMMIT_H_
#define HYPERMAP_SERVER_SESSION_GROUP_COMMIT_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/functional/any_invocable.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/admission/content_budget.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "map/edits/apply.h"
#include "server/fusion/map_fusion.h"
#include "server/session/change_feed.h"
#include "storage/map_store.h"

namespace hypermap::server {

// A batch of edits, as a caller submits it.
struct Submission {
  EditBatch batch;
  std::string author;
  // Recognises a retry. Empty: a retry is carried out again.
  std::string request_id;
  // Digest of everything that the request asks, so that another request with the same id is not
  // taken for a retry.
  std::string request_digest = {};
  // Tells whether the caller still waits; null if it doesn't matter. Used until the batch is
  // written, and not after the callback is called.
  std::shared_ptr<Cancellation> cancellation = nullptr;
  // The caller's name in budgets (CallTicket::client), which may fill half of the map's queue.
  // Empty for work of the server itself, which the whole queue bounds.
  std::string client = {};
};

struct FusionSubmission {
  FusionCommand command;
  std::string author;
  // As in Submission.
  std::string request_id;
  std::string request_digest = {};
  std::shared_ptr<Cancellation> cancellation = nullptr;
  std::string client = {};
};

struct ObservationSubmission {
  std::string layer;
  std::vector<Observation> observations;
  std::string author;
  // As in Submission, but used only until the observations are judged: others share what follows.
  std::shared_ptr<Cancellation> cancellation = nullptr;
  std::string client = {};
  // The time by which their stamps are judged; nullopt: that of the commit, which may be ahead of
  // the clock, because commit times never go back.
  std::optional<absl::Time> judged_at = std::nullopt;
};

using ReceiptCallback = absl::AnyInvocable<void(absl::StatusOr<storage::Receipt>) &&>;
// One verdict for each observation, in order, or an error that concerns all of them.
using VerdictsCallback =
    absl::AnyInvocable<void(absl::StatusOr<std::vector<ObservationVerdict>>) &&>;

// Applies submissions one after another, each to the map that the ones before it have made, writes
// all of them in one transaction, then answers. A batch that fails changes nothing and does not
// affect the others. A request that is already in the group or in the store gets the earlier one's
// receipt; another request with its id is INVALID_ARGUMENT. Consecutive observations of one layer
// become one revision, so that late ones cost one fold of the log together instead of one each; its
// author names the authors of them, of many only some. A submission whose caller has gone before it
// is applied changes nothing.
//
// A batch or a rebuild that would make the content of all maps exceed --max_content_bytes is
// RESOURCE_EXHAUSTED, and so are observations for whose largest possible growth there is no room.
// Batches that only delete are never refused. Edits that fused layers make in reaction to others
// are counted and not refused.
//
// Not thread safe. Use: perhaps LookUpReceipts, then Add..., Write, TakeCommits and publish
// snapshot(), CountContent, TakeAnswers.
class GroupCommit {
 public:
  // `stored` and `fusion` must outlive this, and be at the revision of `base`. So must `content`,
  // which has the bytes of its content.
  GroupCommit(storage::StoredMap* stored, MapFusion* fusion, SnapshotPtr base, const Limits& limits,
              admission::ContentBudget::Share* content);

  // Asks the store whether it has receipts of these requests, with one question instead of one in
  // each Add. On error Add asks.
  void LookUpReceipts(absl::Span<const std::string> request_ids);

  void Add(Submission submission, absl::Time time, ReceiptCallback done);
  void Add(FusionSubmission submission, absl::Time time, ReceiptCallback done);
  void Add(ObservationSubmission submission, absl::Time time, VerdictsCallback done);

  // Bytes of the changes made so far, as the change feed weighs them; layers that are created or
  // deleted count as more.
  int64_t bytes() const { return bytes_; }

  // Writes the group. On error nothing of it is stored, snapshot() is the base again, and each
  // submission that depends on the write is answered with the error: also if all callers have gone
  // meanwhile, unless fused layers are loaded.
  absl::Status Write();

  // After Write: what the store answered; nullopt if it was not asked to write.
  const std::optional<absl::Status>& stored() const { return written_; }

  // After Write: the newest stored snapshot.
  const SnapshotPtr& snapshot() const { return tip_; }

  // After Write: the group's commits for the change feed; none if the write failed. Call it once.
  std::vector<FeedCommit> TakeCommits();

  // After Write, when snapshot() is published: sets the map's share of the content budget to the
  // new size of its content.
  void CountContent();

  // After TakeCommits: the calls of all callbacks, in the order of the submissions. They may
  // outlive this. Call it once.
  std::vector<absl::AnyInvocable<void() &&>> TakeAnswers();

 private:
  struct PendingReceipt {
    ReceiptCallback done;
    absl::StatusOr<storage::Receipt> answer;
    // True if the answer depends on commits of this group, so that it holds only if they are
    // written.
    bool needs_write;
    std::shared_ptr<Cancellation> cancellation = nullptr;  // as in Submission
  };
  struct PendingVerdicts {
    VerdictsCallback done;
    absl::StatusOr<std::vector<ObservationVerdict>> answer;
  };
  using Pending = std::variant<PendingReceipt, PendingVerdicts>;
  // Consecutive observations of a layer that are admitted and not folded yet.
  struct Run {
    std::string layer;
    std::set<std::string> authors;
    absl::Time time;          // of the first
    size_t first_pending;     // index in pending_ of the first
    int64_t most_growth = 0;  // of the content by all of them, which is taken from content_
  };

  // The part of a submission that does not say what is to be done.
  struct Origin {
    std::string author;
    std::string request_id;
    std::string request_digest;
    std::shared_ptr<Cancellation> cancellation = nullptr;
  };

  // The next revision, not committed yet. Without a snapshot there was nothing to do.
  struct Step {
    AppliedBatch applied;
    std::vector<storage::FusionChange> fusion_changes;
  };

  // Lets the fused layers work. If memory fails within it, fusion is broken, which makes
  // WriteCommits fail the whole group.
  template <typename Work>
  std::invoke_result_t<Work> Fuse(const Work& work);
  // Applies the batch and the reaction of fused layers to it, as one revision.
  absl::StatusOr<Step> Edit(const EditBatch& batch);
  // Reserves room for growth of the content; negative growth leaves room for later batches of the
  // group. RESOURCE_EXHAUSTED if there is no room, unless it may not be refused. GiveUp undoes it.
  absl::Status Grow(int64_t bytes, bool may_be_refused);
  void GiveUp(int64_t bytes) { growth_ -= bytes; }
  // Bytes by which the next batch may make the content grow.
  int64_t Room() const;
  // Applies the batch and then the reaction's edits, as one revision. If it may not be refused, the
  // content grows whatever its limit.
  absl::StatusOr<Step> CarryOut(EditBatch batch, FusionReaction reaction, bool may_be_refused);
  // The bytes by which the observations may make the content grow, at most.
  int64_t MostGrowthOf(const ObservationSubmission& submission);

  // Makes a request's revision from tip_.
  using JudgeFunction = absl::FunctionRef<absl::StatusOr<Step>()>;
  // The receipt that the store has of a request.
  absl::StatusOr<std::optional<storage::Receipt>> FindReceipt(const std::string& request_id) const;
  // Answers with the request's earlier receipt, or carries it out.
  void AddGuarded(const Origin& origin, absl::Time time, ReceiptCallback done, JudgeFunction judge);
  absl::StatusOr<storage::Receipt> Judge(const Origin& origin, absl::Time time,
                                         JudgeFunction judge);
  // Folds the observations of run_ as one revision.
  void EndRun();
  void Commit(Step step, const Origin& origin, absl::Time time);
  absl::Status WriteCommits();
  // Calls the callback of a submission. `newest` is the newest stored revision.
  static void Answer(Pending pending, Revision newest);
  // The error of a caller, if all callers that wait for the write have gone.
  absl::Status CheckWanted() const;
  // An error of the store as callers are told it.
  absl::Status ForCaller(const absl::Status& status) const;

  storage::StoredMap* const stored_;
  MapFusion* const fusion_;
  const SnapshotPtr base_;
  const Limits limits_;
  admission::ContentBudget::Share* const content_;
  // Bytes by which commits_ make the content grow, and bytes that are reserved in content_ for
  // that. Bytes that the group frees stay reserved for its own later batches until CountContent,
  // because the memory is in use until the group is stored.
  int64_t growth_ = 0;
  int64_t taken_ = 0;
  SnapshotPtr tip_;  // the map after commits_
  std::vector<storage::Commit> commits_;
  int64_t bytes_ = 0;             // of the changes of commits_
  std::vector<Pending> pending_;  // in order of submission
  std::optional<Run> run_;
  std::optional<absl::Status> written_;
  // What LookUpReceipts has found.
  absl::flat_hash_map<std::string, std::optional<storage::Receipt>> looked_up_;
  // Receipts of commits_, which the store does not have yet.
  absl::flat_hash_map<std::string, storage::Receipt> by_request_id_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_GROUP_COMMIT_H_
