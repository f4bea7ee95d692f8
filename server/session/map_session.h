// One open map: what its readers see and the single writer that changes it.
//
// Readers copy a pointer to the newest snapshot and go on without any lock; they never wait for a
// disk. Batches wait in a bounded queue for the map's writer thread, which takes all that have
// queued, commits them in one transaction (each keeps its own revision), publishes the snapshot and
// then answers: what was answered is on disk and visible, and nothing is visible that is not on
// disk. A commit's time is never before that of the one before it. Between groups the writer
// removes objects whose time has come and lets go of history that need not be kept. Thread safe.
#ifndef HYPERMAP_SERVER_SESSION_MAP_SESSION_H_
#define HYPERMAP_SERVER_SESSION_MAP_SESSION_H_

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "map/edits/apply.h"
#include "map/snapshot.h"
#include "server/fusion/map_fusion.h"
#include "server/session/change_feed.h"
#include "server/session/compaction.h"
#include "server/session/expiry.h"
#include "server/session/group_commit.h"
#include "server/session/history_pool.h"
#include "storage/map_store.h"

namespace hypermap::server {

struct SessionOptions {
  // Batches that may wait for the writer.
  int max_queue = 1024;
  EditLimits edit_limits;
  FusionOptions fusion;
  ChangeFeed::Limits feed;
  Retention retention;
  // What commits are stamped by, and by when objects leave the map.
  std::function<absl::Time()> clock = [] { return absl::Now(); };
};

class MapSession {
 public:
  // Loads the map and starts its writer. Errors are those of StoredMap::Load.
  static absl::StatusOr<std::unique_ptr<MapSession>> Start(
      std::unique_ptr<storage::StoredMap> stored, const SessionOptions& options);

  // Closes.
  ~MapSession();
  MapSession(const MapSession&) = delete;
  MapSession& operator=(const MapSession&) = delete;

  const storage::MapHeader& header() const { return header_; }

  // The newest revision.
  SnapshotPtr snapshot() const;

  // The newest commits; closed when the session is about to be.
  ChangeFeed& feed() { return feed_; }
  // All kept ones, and what the map was. UNAVAILABLE when the session is closed.
  absl::StatusOr<HistoryPool::Lease> OpenHistory() { return history_.Take(); }

  // Answers `done` with the receipt once the batch is on disk, or with why it changed nothing, on
  // the writer's thread. RESOURCE_EXHAUSTED when the queue is full, UNAVAILABLE when the session is
  // closed; then on the caller's thread. `done` must not wait and must not own the session.
  void Submit(Submission submission, ReceiptCallback done);
  void Run(FusionSubmission submission, ReceiptCallback done);
  // The same with observations: answered when they are on disk, fused and visible. Errors besides:
  // those of MapFusion::Admit.
  void Observe(ObservationSubmission submission, VerdictsCallback done);

  // Submit that waits for the answer.
  absl::StatusOr<storage::Receipt> SubmitAndWait(Submission submission);
  absl::StatusOr<storage::Receipt> RunAndWait(FusionSubmission submission);

  // What an earlier request of that id was answered; waits for the writer. Errors as Submit.
  absl::StatusOr<std::optional<storage::Receipt>> FindReceipt(const std::string& request_id);

  // Runs `task` with the map's fusion, between two groups, and waits for it. NOT_FOUND,
  // FAILED_PRECONDITION when the layer is not there or not fused; errors as Submit.
  using FusionTask = absl::FunctionRef<absl::Status(FusedLayer&)>;
  absl::Status InspectFusion(const std::string& layer, FusionTask task);

  // Entries of a fused layer's log after `after`, at most `max_entries`; waits. Errors as
  // InspectFusion.
  absl::StatusOr<std::vector<Evidence>> ReadEvidence(const std::string& layer,
                                                     const storage::LogKey& after, int max_entries);

  const SessionOptions& options() const { return options_; }

  // Writes a consistent copy of the newest stored revision; waits for it. Edits wait meanwhile,
  // readers don't. Errors as StoredMap::BackupTo and Submit.
  absl::Status BackupTo(const std::string& path);

  // Has the writer look at the clock again, which may have been set.
  void LookAtClock();

  // Takes nothing more, finishes and answers what was accepted, closes the stored map. Called by
  // one thread at a time; again is a no-op.
  void Close();

 private:
  template <typename SubmissionType, typename Callback>
  struct Queued {
    SubmissionType submission;
    Callback done;
  };
  using QueuedSubmission =
      std::variant<Queued<Submission, ReceiptCallback>, Queued<FusionSubmission, ReceiptCallback>,
                   Queued<ObservationSubmission, VerdictsCallback>>;
  using Task = absl::AnyInvocable<void() &&>;
  struct Work {
    std::vector<QueuedSubmission> submissions;
    std::vector<Task> tasks;  // run when the submissions are stored

    bool empty() const { return submissions.empty() && tasks.empty(); }
  };

  MapSession(std::unique_ptr<storage::StoredMap> stored, SnapshotPtr snapshot,
             const SessionOptions& options);

  template <typename SubmissionType, typename Callback>
  void Enqueue(SubmissionType submission, Callback done);
  template <typename SubmissionType>
  absl::StatusOr<storage::Receipt> EnqueueAndWait(SubmissionType submission);
  // Runs the task on the writer's thread, and waits for it.
  absl::Status RunOnWriter(absl::FunctionRef<absl::Status()> task);

  absl::Status LoadLastCommitTime();

  // The writer's thread.
  void RunWriter();
  // Waits for work or a time to look after the map; nullopt when the session is closed.
  std::optional<Work> TakeWork();
  void Commit(std::vector<QueuedSubmission> submissions);
  // The clock's time, but never before an earlier one.
  absl::Time CommitTime();

  // What the map needs apart from what callers want.
  void LookAfterMap();
  absl::Time NextLookAfterMap() const;
  void RemoveExpired(absl::Time now);

  absl::Status CheckAccepts(size_t queued) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(queue_mutex_);

  const SessionOptions options_;
  const storage::MapHeader header_;
  // Of the writer's thread while it runs.
  std::unique_ptr<storage::StoredMap> stored_;
  std::unique_ptr<MapFusion> fusion_;
  absl::Time last_commit_time_;
  ExpirySchedule expiry_;
  absl::Time expire_not_before_ = absl::InfinitePast();
  int groups_since_compaction_ = 0;

  HistoryPool history_;
  Compaction compaction_;  // of the writer's thread

  mutable Mutex snapshot_mutex_;
  SnapshotPtr snapshot_ ABSL_GUARDED_BY(snapshot_mutex_);
  ChangeFeed feed_;

  Mutex queue_mutex_;
  CondVar queue_changed_;
  Work queue_ ABSL_GUARDED_BY(queue_mutex_);
  bool closing_ ABSL_GUARDED_BY(queue_mutex_) = false;
  bool looks_at_clock_ ABSL_GUARDED_BY(queue_mutex_) = false;

  std::thread writer_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_MAP_SESSION_H_
