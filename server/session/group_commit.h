// Batches, observations and fusion commands that go to disk together.
#ifndef HYPERMAP_SERVER_SESSION_GROUP_COMMIT_H_
#define HYPERMAP_SERVER_SESSION_GROUP_COMMIT_H_

#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/functional/any_invocable.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/edits/apply.h"
#include "server/fusion/map_fusion.h"
#include "server/session/change_feed.h"
#include "storage/map_store.h"

namespace hypermap::server {

// A batch or a command as a caller hands it in.
struct Submission {
  EditBatch batch;
  std::string author;
  // Empty: not guarded against repetition.
  std::string request_id;
};

struct FusionSubmission {
  FusionCommand command;
  std::string author;
  // Empty: not guarded against repetition.
  std::string request_id;
};

struct ObservationSubmission {
  std::string layer;
  std::vector<Observation> observations;
  std::string author;
};

using ReceiptCallback = absl::AnyInvocable<void(absl::StatusOr<storage::Receipt>) &&>;
// A verdict for each observation, in order; an error is of all of them.
using VerdictsCallback =
    absl::AnyInvocable<void(absl::StatusOr<std::vector<ObservationVerdict>>) &&>;

// Takes submissions one after another, each judged by what the ones before it made of the map,
// writes all of them in one transaction, then answers. A batch that fails changes nothing and
// spoils nothing; a request that is already in the group or in the store gets the earlier one's
// receipt. Observations of one layer that follow each other become one revision, so that they are
// folded at once however late they are. One thread. Used as: Add..., Write, (publish snapshot()),
// Answer.
class GroupCommit {
 public:
  // `stored` and `fusion` must outlive this and hold `base`.
  GroupCommit(storage::StoredMap* stored, MapFusion* fusion, SnapshotPtr base);

  void Add(Submission submission, absl::Time time, ReceiptCallback done);
  void Add(FusionSubmission submission, absl::Time time, ReceiptCallback done);
  void Add(ObservationSubmission submission, absl::Time time, VerdictsCallback done);

  // On error nothing of the group is stored, and snapshot() is the base again.
  absl::Status Write();

  // The newest snapshot that is stored, after Write.
  const SnapshotPtr& snapshot() const { return tip_; }

  // What followers are told of the group, after a Write that went well. Called once.
  std::vector<FeedCommit> TakeCommits();

  // Calls every callback, in the order of the submissions.
  void Answer() &&;

 private:
  struct PendingReceipt {
    ReceiptCallback done;
    absl::StatusOr<storage::Receipt> answer;
    // Whether the answer was found on a map that only exists if the group is written.
    bool needs_write;
  };
  struct PendingVerdicts {
    VerdictsCallback done;
    absl::StatusOr<std::vector<ObservationVerdict>> answer;
  };
  // Observations that are admitted and not folded yet.
  struct Run {
    std::string layer;
    std::set<std::string> authors;
    absl::Time time;
    size_t first_pending;
  };

  using JudgeFunction = absl::FunctionRef<absl::StatusOr<FusionStep>()>;
  // Finds the earlier receipt of a request, or judges it.
  void AddGuarded(const std::string& author, const std::string& request_id, absl::Time time,
                  ReceiptCallback done, JudgeFunction judge);
  absl::StatusOr<storage::Receipt> Judge(const std::string& author, const std::string& request_id,
                                         absl::Time time, JudgeFunction judge);
  // Folds what the run gathered, as one revision.
  void EndRun();
  void Commit(FusionStep step, const std::string& author, absl::Time time,
              const std::string& request_id);
  absl::Status WriteCommits();

  storage::StoredMap* const stored_;
  MapFusion* const fusion_;
  const SnapshotPtr base_;
  SnapshotPtr tip_;
  std::vector<storage::Commit> commits_;
  std::vector<std::variant<PendingReceipt, PendingVerdicts>> pending_;
  std::optional<Run> run_;
  // Receipts that this group is to store.
  absl::flat_hash_map<std::string, storage::Receipt> by_request_id_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_GROUP_COMMIT_H_
