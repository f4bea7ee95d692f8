// Edit batches that go to disk together.
#ifndef HYPERMAP_SERVER_SESSION_GROUP_COMMIT_H_
#define HYPERMAP_SERVER_SESSION_GROUP_COMMIT_H_

#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/edits/apply.h"
#include "storage/map_store.h"

namespace hypermap::server {

// A batch as a caller hands it in.
struct Submission {
  EditBatch batch;
  std::string author;
  // Empty: not guarded against repetition.
  std::string request_id;
};

using ReceiptCallback = absl::AnyInvocable<void(absl::StatusOr<storage::Receipt>) &&>;

// Takes batches one after another, each judged by what the ones before it made of the map, writes
// all of them in one transaction, then answers. A batch that fails changes nothing and spoils
// nothing; a request that is already in the group or in the store gets the earlier one's receipt.
// One thread. Used as: Add..., Write, (publish snapshot()), Answer.
class GroupCommit {
 public:
  // `stored` must outlive this and hold `base`.
  GroupCommit(storage::StoredMap* stored, SnapshotPtr base, const EditLimits& limits);

  void Add(Submission submission, absl::Time time, ReceiptCallback done);

  // On error nothing of the group is stored, and snapshot() is the base again.
  absl::Status Write();

  // The newest snapshot that is stored, after Write.
  const SnapshotPtr& snapshot() const { return tip_; }

  // Calls every callback, in the order of the batches.
  void Answer() &&;

 private:
  struct Pending {
    ReceiptCallback done;
    absl::StatusOr<storage::Receipt> answer;
    // Whether the answer was found on a map that only exists if the group is written.
    bool needs_write;
  };

  absl::StatusOr<storage::Receipt> Judge(Submission submission, absl::Time time);

  storage::StoredMap* const stored_;
  const SnapshotPtr base_;
  const EditLimits limits_;
  SnapshotPtr tip_;
  std::vector<storage::Commit> commits_;
  std::vector<Pending> pending_;
  // Receipts that this group is to store.
  absl::flat_hash_map<std::string, storage::Receipt> by_request_id_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_GROUP_COMMIT_H_
