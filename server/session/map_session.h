// One open map: the newest snapshot for readers, and the single writer that changes the map.
//
// Readers copy a pointer to the newest snapshot and work on it without locks; they never wait for a
// disk. Batches wait for the map's writer thread in a queue that is bounded by their number and
// their bytes, and of which one client may fill half. The writer takes all queued batches, commits
// them in one transaction (each with its own revision; in several, if their changes are large),
// publishes the snapshot, and then answers: an acknowledged batch is on disk and visible, and
// nothing is visible that is not on disk. Commit times never decrease. Between groups the writer
// removes expired objects and compacts the history, both by the time that really passed (MapTime),
// and folds late observations in advance (LateObservations).
// Thread safe.
#ifndef HYPERMAP_SERVER_SESSION_MAP_SESSION_H_
#define HYPERMAP_SERVER_SESSION_MAP_SESSION_H_

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/functional/any_invocable.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/admission/content_budget.h"
#include "base/limits/limits.h"
#include "base/sync/executor.h"
#include "base/sync/mutex.h"
#include "base/time/server_clock.h"
#include "map/check_report.h"
#include "map/observations/robot_clocks.h"
#include "map/snapshot.h"
#include "server/fusion/map_fusion.h"
#include "server/presence/map_robots.h"
#include "server/session/answers.h"
#include "server/session/change_feed.h"
#include "server/session/compaction.h"
#include "server/session/expiry.h"
#include "server/session/group_commit.h"
#include "server/session/history_pool.h"
#include "server/session/late_observations.h"
#include "server/session/map_follower.h"
#include "server/session/map_health.h"
#include "server/session/map_time.h"
#include "server/session/queue_load.h"
#include "server/session/session_meters.h"
#include "storage/map_store.h"

namespace hypermap::server {

// Author of the commits by which the server removes expired objects.
inline constexpr char kExpiryAuthor[] = "expiry";

struct SessionOptions {
  Limits limits;
  FusionOptions fusion;
  ChangeFeed::Limits feed;
  // Bytes of changes at which a group is written although more submissions wait. A small submission
  // can make large changes.
  int64_t max_group_bytes = int64_t{64} << 20;
  // Time after which a group takes no further submission: tasks, for which threads of all maps may
  // wait, come after it.
  absl::Duration max_group_time = absl::Milliseconds(50);
  // Runs the writers of the maps, by its time; must outlive them.
  Executor* executor = &ThreadExecutor();
  // The clock of all maps of a site: of commit times, ages, the expiry of objects, and of the
  // stamps of observations, unless `fusion` has a clock of its own.
  std::shared_ptr<ServerClock> clock = std::make_shared<ServerClock>();
  // The memory of the content of all maps, and its limit.
  std::shared_ptr<admission::ContentBudget> content = std::make_shared<admission::ContentBudget>();
  // Gives answers while the writers have other work; must outlive them. Null: the writers do.
  Answers* answers = nullptr;
};

class MapSession {
 public:
  // Loads the map and starts its writer. Errors are those of StoredMap::Load.
  static absl::StatusOr<std::unique_ptr<MapSession>> Start(
      std::unique_ptr<storage::StoredMap> stored, const SessionOptions& options);

  // Loads a map that another server owns, and follows it: the snapshots and the feed are those of
  // the owner. Whatever needs the writer is refused with NotOwnerError. `owner` is as for SetOwner.
  static absl::StatusOr<std::unique_ptr<MapSession>> Follow(
      std::unique_ptr<storage::StoredMap> stored, const std::string& owner,
      const SessionOptions& options);

  // Calls Close.
  ~MapSession();
  MapSession(const MapSession&) = delete;
  MapSession& operator=(const MapSession&) = delete;

  const storage::MapHeader& header() const { return header_; }
  // Distinguishes the history of this map from all others, see v1::Map.incarnation. Never 0.
  uint64_t incarnation() const { return header_.incarnation; }
  // OK while the map works; DATA_LOSS with the reason once its files were found removed, replaced
  // or changed by another program. The session then refuses all submissions with that reason, and
  // its feed is closed.
  absl::Status problem() const;

  // What can be done with the map at the moment.
  MapCondition condition() const;
  // ABORTED if the map is another incarnation than `expected`; 0 expects any.
  absl::Status CheckIncarnation(uint64_t expected) const;

  // Tells who owns the map: another server, by its address (empty if it is not known), or this one
  // (nullopt, as at the start). While another server owns it, new submissions and tasks for the
  // writer are refused with CheckOwner; those that wait are carried out.
  void SetOwner(std::optional<std::string> address);
  // OK if this server owns the map, or else NotOwnerError.
  absl::Status CheckOwner() const;

  // Whether the map was opened by Follow.
  bool is_follower() const { return follower_.has_value(); }
  // Of a followed map: there may be new revisions in the store.
  void LookForRevisions();

  // The newest published snapshot.
  SnapshotPtr snapshot() const;

  // The newest commits. Closed as the first step of Close.
  ChangeFeed& feed() { return feed_; }
  // The robots that report where they are on the map.
  MapRobots& robots() { return robots_; }
  // A reader of all kept commits and past revisions. UNAVAILABLE if the session is closed.
  absl::StatusOr<HistoryPool::Lease> OpenHistory() { return history_.Take(); }

  // Calls `done` on the writer's thread: with the receipt once the batch is on disk and visible, or
  // with the error for which it changed nothing. RESOURCE_EXHAUSTED if the queue or its half of the
  // submission's client is full (by number or by bytes; an empty queue takes a submission of any
  // size, and so does the half of a client of which none waits, if the queue has room) and
  // UNAVAILABLE if the session is closed; then on the caller's thread. `done` must not wait and
  // must not own the session.
  void Submit(Submission submission, ReceiptCallback done);
  void Run(FusionSubmission submission, ReceiptCallback done);
  // Likewise for observations, which are answered when they are on disk, fused and visible. Errors
  // also as MapFusion::Admit.
  void Observe(ObservationSubmission submission, VerdictsCallback done);

  // Submit and Run that wait for the answer, and use the cancellation of this thread.
  absl::StatusOr<storage::Receipt> SubmitAndWait(Submission submission);
  absl::StatusOr<storage::Receipt> RunAndWait(FusionSubmission submission);

  // The receipt of an earlier request; nullopt if there is none. Waits for the writer. Errors as
  // Submit and StoredMap::FindReceipt.
  absl::StatusOr<std::optional<storage::Receipt>> FindReceipt(const std::string& request_id);

  // Runs `task` with a fused layer on the writer's thread, between two groups, and waits for it.
  // Like all tasks of the writer for which a caller waits, it has the caller's cancellation.
  // NOT_FOUND if there is no such layer, FAILED_PRECONDITION if it is not fused; errors as Submit.
  using FusionTask = absl::FunctionRef<absl::Status(FusedLayer&)>;
  absl::Status InspectFusion(const std::string& layer, FusionTask task);

  // At most `max_entries` entries of a fused layer's log after `after`, in order. Waits for the
  // writer. Errors as Submit and FusionLog::Read; DATA_LOSS for an entry that can't be decoded.
  absl::StatusOr<std::vector<Evidence>> ReadEvidence(const std::string& layer,
                                                     const storage::LogKey& after, int max_entries);

  // The base of a fused layer's log; nullopt if all its entries are kept. Waits for the writer.
  // Errors as Submit and FusionLog::FindBase.
  absl::StatusOr<std::optional<storage::FusionBase>> ReadEvidenceBase(const std::string& layer);

  // The clocks of the robots that sent observations since the map was opened, the one that sent
  // last first. Waits for the writer. Errors as Submit.
  absl::StatusOr<std::vector<RobotClocks::Robot>> ReadRobotClocks();

  SessionMeters& meters() { return meters_; }
  const SessionMeters& meters() const { return meters_; }
  // Submissions that wait for the writer.
  QueueLoad::Size queue_size() const;

  const SessionOptions& options() const { return options_; }
  const MapTime& time() const { return time_; }

  // Writes a consistent copy of the newest stored revision to `path`, on this thread: edits wait
  // only until its files are open. `reserve` is called before anything is written, with the most
  // bytes of disk that the copy takes if there are no edits meanwhile; its error is returned, and
  // there is no copy. Errors as StoredMap::BackupTo and Submit.
  absl::Status BackupTo(const std::string& path,
                        absl::FunctionRef<absl::Status(int64_t most_bytes)> reserve);

  // Checks the newest stored revision as a whole, on this thread: edits wait only until its files
  // are open. Errors as StoredMap::OpenCheck, MapCheck::Run and Submit.
  absl::StatusOr<CheckReport> Check();

  // Ends writing before Close, when another server takes the map over: sends new submissions to the
  // owner at `owner`, and finishes and answers the accepted ones. What is shown afterwards is all
  // that was acknowledged. Questions and watches go on. Not of a follower; must be called as Close.
  void HandOver(const std::string& owner);
  // Of a follower: waits until it shows the revision, its feed is closed, or the time is over.
  void CatchUp(Revision revision, absl::Duration timeout);

  // Ends what may wait long, before Close: closes the feed, so that watches and calls that wait for
  // a revision end, and refuses late observations with UNAVAILABLE.
  void EndWaiting();
  // Which of the servers that share the store may open the map after this session.
  enum class NextOwner { kAnyServer, kThisServer };
  // Refuses new submissions, finishes and answers the accepted ones, and closes the stored map.
  // Must be called by one thread at a time; a second call does nothing.
  void Close(NextOwner next = NextOwner::kAnyServer);

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
    QueueLoad load;           // of the submissions
    std::vector<Task> tasks;  // run between two groups of submissions

    bool empty() const { return submissions.empty() && tasks.empty(); }
  };

  MapSession(std::unique_ptr<storage::StoredMap> stored, const SnapshotPtr& snapshot,
             std::vector<storage::TimeMark> marks, absl::Time newest_commit,
             const SessionOptions& options);

  // Makes a session that has no writer yet.
  static absl::StatusOr<std::unique_ptr<MapSession>> Load(
      std::unique_ptr<storage::StoredMap> stored, const SessionOptions& options);

  template <typename SubmissionType, typename Callback>
  void Enqueue(SubmissionType submission, Callback done);
  template <typename SubmissionType>
  absl::StatusOr<storage::Receipt> EnqueueAndWait(SubmissionType submission);
  // Runs the task on the writer's thread, and waits for it. UNAVAILABLE, RESOURCE_EXHAUSTED as
  // Submit; the error of this thread's cancellation, if that comes before the task begins.
  absl::Status RunOnWriter(absl::FunctionRef<absl::Status()> task);

  // A step of the writer: commits what waits, then does what maintenance is due. Returns the time
  // until there is something to do again, or nullopt once the session is closed.
  std::optional<absl::Duration> Step();
  // A step of a follower: reads and publishes revisions that are new in the store. Returns as Step.
  std::optional<absl::Duration> FollowStep();
  // Ends the service of a follower that can't go on from its revision.
  void EndFollowing(const absl::Status& reason);
  // Shows the commits to readers and watches, except that feed_.Wake must follow.
  void Publish(const SnapshotPtr& snapshot, std::vector<FeedCommit> commits);
  // What is left to do when the session is closed.
  void EndWriting();
  // Makes the loop end once it has finished and answered what was accepted, and waits for that.
  void EndLoop();
  absl::Duration UntilNextStep() const;
  // Takes the submissions that wait, of which there may be none. nullopt if the session is closing
  // and the queue is empty.
  std::optional<std::vector<QueuedSubmission>> TakeSubmissions();
  // Writes the submissions in groups. Runs the tasks that wait before each but the first.
  void Commit(std::vector<QueuedSubmission> submissions);
  // Has the group look up the receipts of those of the submissions that are edits.
  static void LookUpReceipts(absl::Span<const QueuedSubmission> submissions, GroupCommit* group);
  void RunTasks();
  // Returns whether the submission waits in late_ now, which has taken it.
  bool SetAside(Queued<ObservationSubmission, VerdictsCallback>& queued);
  // Folds late observations in advance for a short time, and commits those that are ready; or
  // refuses all of them.
  void WorkOnLate();
  void RefuseLate();
  // Writes, publishes and answers a group.
  void Finish(GroupCommit& group);
  bool HasSubmissions() const;
  // Gives the answers of a group, after those of the groups before it: here, until there is other
  // work for this thread, and the rest on another one.
  void Answer(GroupCommit& group);
  // Waits until all answers are given.
  void FlushAnswers();
  // Stores the mark, if there is one. A failure is logged; the next commit needs another mark.
  void KeepMark(const std::optional<storage::TimeMark>& mark);

  // Notices that the files of the map are no longer those that were opened, and ends its service.
  void CheckFiles();
  // Notes what the store answered to an attempt to write.
  void NoteWrite(const absl::Status& written);
  // Maintenance between two groups: expiry, compaction and marks of time.
  void MaintainMap();
  // Time until the next maintenance; may be negative.
  absl::Duration UntilMaintenance() const;
  absl::Duration UntilExpiry() const;
  void RemoveExpired();

  // Checks whether a submission or task of `bytes` may wait behind `queued` others.
  absl::Status CheckAccepts(int64_t queued, int64_t bytes) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(queue_mutex_);
  // Checks whether the client may add a submission of `bytes` to its half of the queue.
  absl::Status CheckShare(const std::string& client, int64_t bytes) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(queue_mutex_);

  const SessionOptions options_;
  const storage::MapHeader header_;
  // Used by the writer's thread only, while it runs.
  std::unique_ptr<storage::StoredMap> stored_;
  std::unique_ptr<MapFusion> fusion_;    // null if the map is followed
  std::optional<MapFollower> follower_;  // of a followed map; set before others have the session
  MapTime time_;
  bool mark_failed_ = false;  // the newest attempt to store a mark
  ExpirySchedule expiry_;
  // Value of MapTime::Passed before which no expiry is tried, after a failure.
  absl::Duration expire_not_before_ = -absl::InfiniteDuration();
  int groups_since_compaction_ = 0;
  bool is_broken_ = false;  // used by the writer's thread only: whether problem_ is set
  std::atomic<int> num_unanswered_ = 0;   // groups whose answers are left to options_.answers
  std::optional<LateObservations> late_;  // used by the writer's thread only
  absl::Duration last_commit_took_;       // used by the writer's thread only

  SessionMeters meters_;
  MapHealth health_;
  HistoryPool history_;
  Compaction compaction_;  // used by the writer's thread only

  admission::ContentBudget::Share content_;   // of the newest snapshot; used by the writer's thread
  admission::ContentBudget::Share evidence_;  // of fusion_; used by the writer's thread
  mutable Mutex snapshot_mutex_;
  SnapshotPtr snapshot_ ABSL_GUARDED_BY(snapshot_mutex_);
  ChangeFeed feed_;
  MapRobots robots_;

  mutable Mutex queue_mutex_;
  Work queue_ ABSL_GUARDED_BY(queue_mutex_);
  QueueLoad late_load_ ABSL_GUARDED_BY(queue_mutex_);               // of late_
  std::optional<std::string> owner_ ABSL_GUARDED_BY(queue_mutex_);  // another server's address
  bool closing_ ABSL_GUARDED_BY(queue_mutex_) = false;
  bool refuses_late_ ABSL_GUARDED_BY(queue_mutex_) = false;
  absl::Status problem_ ABSL_GUARDED_BY(queue_mutex_);

  // Set before anybody but Start has the session.
  std::unique_ptr<Executor::Running> writer_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_MAP_SESSION_H_
