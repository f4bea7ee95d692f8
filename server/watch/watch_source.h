// The cursor of one Watch or Replicate rpc, and the messages that it sends.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_SOURCE_H_
#define HYPERMAP_SERVER_WATCH_WATCH_SOURCE_H_

#include <grpcpp/support/slice.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/limits/limits.h"
#include "base/sync/steady_time.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/watch/follower.h"
#include "server/rpc/facilities.h"
#include "server/session/map_session.h"
#include "server/watch/live_source.h"
#include "server/watch/wake_handle.h"
#include "server/watch/watch_group.h"
#include "server/watch/watch_messages.h"
#include "server/watch/watch_tuning.h"

namespace hypermap::server {

// Follows a map commit by commit and makes the messages of one watch. Messages of the newest
// commits come from its WatchGroup, which all watches with the same filter share. The source itself
// encodes what depends on its own state: the initial snapshot, a reset, commits that change the
// map's structure or take several messages, and old commits, which it reads from the map's history
// because the feed no longer has them. Between calls it holds a cursor (a revision), the unsent
// changes of one revision and a bounded number of commits, so that memory does not grow with the
// slowness of a reader.
class WatchSource final : public LiveSource {
 public:
  // `tuning` and `groups` must outlive the source. Errors are those of the rpc.
  static absl::StatusOr<std::unique_ptr<WatchSource>> Open(const Facilities& facilities,
                                                           const WatchTuning& tuning,
                                                           WatchGroups* groups,
                                                           const v1::WatchRequest& request);
  static absl::StatusOr<std::unique_ptr<WatchSource>> Open(const Facilities& facilities,
                                                           const WatchTuning& tuning,
                                                           WatchGroups* groups,
                                                           const v1::ReplicateRequest& request);

  // Makes the bytes of the next WatchMessage, or does a bounded amount of work towards it.
  // kNothingNew means that there is nothing to do until there is a revision after taken(), or until
  // idle_for(now) has passed. UNAVAILABLE if the feed is closed, OUT_OF_RANGE if the next commits
  // are no longer kept, RESOURCE_EXHAUSTED if the reader fell too far behind; all name the revision
  // to resume from.
  absl::StatusOr<Step> Next(SteadyTime now, grpc::Slice* message) override;

  // Makes the next message if the group can provide it, and returns whether it did. Reads no
  // history, waits for nothing but the group's lock, and takes little more than
  // WatchTuning::max_encoding, so that any thread may call it.
  bool TakeShared(SteadyTime now, grpc::Slice* message) override;

  // Returns whether the next message should wait for a tick, so that it contains several commits:
  // the watch may coalesce, and its last message reached the newest revision.
  bool gathers() const override { return gathers_; }
  // Returns whether the watch has so many changes per second that it should wait for the longer
  // tick.
  bool is_busy() const override { return changes_per_s_ > tuning_.busy_changes_per_s; }

  // Waits for a commit after taken().
  void BeginWait(const std::shared_ptr<WakeHandle>& wake_handle) override;
  void EndWait() override;

  ChangeFeed& feed() const { return session_->feed(); }
  // The cursor: the last revision that the source has read.
  Revision taken() const { return taken_; }
  absl::Duration idle_for(SteadyTime now) const override;
  // Number of changes.
  int64_t items() const override { return items_; }
  int64_t memory() const override { return memory_; }
  // Returns whether the source holds changes that were read but not sent. They were charged to the
  // MemoryMeter of the Next that read them, except those of a feed's commit that fits into one
  // message; these are charged when the feed drops the commit.
  bool holds_commits() const override {
    return !commits_.empty() || !telling_.empty() || commit_parts_;
  }

 private:
  // The parameters of a request. The replicas' rpc is the one with Frames::kAsStored.
  struct Subscription {
    std::string map;
    uint64_t incarnation = 0;  // that the map must be; 0: any
    WatchFilter filter;
    WatchGroup::Form form = WatchGroup::Form::kSingle;
    std::optional<Revision> start_revision;  // absent: begins with a snapshot
    std::optional<absl::Time> start_time;    // at which start_revision must have been made
  };

  static absl::StatusOr<std::unique_ptr<WatchSource>> Open(const Facilities& facilities,
                                                           const WatchTuning& tuning,
                                                           WatchGroups* groups,
                                                           const Subscription& subscription);

  WatchSource(const Limits& limits, const WatchTuning& tuning, std::shared_ptr<MapSession> session,
              std::shared_ptr<WatchGroup> group, Follower follower, StructurePtr structure,
              Revision start, const Subscription& subscription);

  // Moves the cursor to `snapshot`; the next messages contain all that the filter selects there.
  absl::Status BeginSelection(SnapshotPtr snapshot, bool reset);
  Step ReadSelection(SteadyTime now, grpc::Slice* message);
  // Moves the cursor over the next commits, with the group's messages where it has them.
  absl::StatusOr<Step> TakeCommits(SteadyTime now, grpc::Slice* message);
  // Moves the cursor over the first of commits_, which this watch encodes alone.
  absl::StatusOr<Step> TakeCommit(SteadyTime now, grpc::Slice* message);
  // Reads on in commit_parts_, and tells the next part once a message is full.
  absl::StatusOr<Step> ReadCommit(SteadyTime now, grpc::Slice* message);
  // Charges for what is held of a commit. RESOURCE_EXHAUSTED.
  absl::Status ChargeRest();
  // Fills commits_ from the feed, or from the history with commits up to `newest`.
  absl::Status ReadCommits(Revision newest);
  // Encodes the next part of telling_.
  Step TellNext(SteadyTime now, grpc::Slice* message);
  // Sends the message of `run`, and moves the cursor to its end.
  Step TellRun(SteadyTime now, const WatchGroup::Run& run, grpc::Slice* message);
  // Sends a message without changes, which moves the reader's resume point to the cursor.
  absl::StatusOr<Step> TellProgress(SteadyTime now, grpc::Slice* message);
  // Adds the fields that only replicas get to a message that is not a commit's: the time of its
  // revision, and in the rpc's first message the map.
  void AddForReplica(absl::Time time, WatchMessage* message);
  // Time at which a message without changes is due.
  SteadyTime ProgressDue() const;
  // The error with the revision to resume from.
  absl::Status WithResume(const absl::Status& status) const;

  const Limits limits_;
  const WatchTuning& tuning_;
  const std::shared_ptr<MapSession> session_;
  const std::shared_ptr<WatchGroup> group_;  // reads session_'s feed
  const WatchGroup::Form form_;
  const bool for_replica_;
  const int64_t memory_;
  Follower follower_;
  StructurePtr structure_;  // the map's at taken_; follower_ has the same

  Revision taken_;                  // the cursor: commits up to here were filtered
  Revision told_;                   // messages cover all up to here: the revision to resume from
  int64_t max_lag_;                 // upper bound of newest revision - taken_
  std::deque<FeedCommit> commits_;  // the next commits after taken_

  // Changes of revision taken_ that are being sent: a part of the selection, or of one commit.
  std::vector<MapChange> telling_;
  size_t next_ = 0;    // index of the first of telling_ that is not in a message yet
  FeedCommit commit_;  // the commit of telling_, without its changes; for a replica's selection,
                       // only the time is set
  std::unique_ptr<SelectionReader> commit_parts_;  // null while there is no commit to tell
  int64_t commit_bytes_ = 0;                       // of the commit, as long as they are not charged
  int64_t telling_charge_ = 0;                     // bytes charged for telling_
  std::unique_ptr<SelectionReader> selection_;     // null while telling_ is a commit's
  bool selection_resets_ = false;                  // the selection's first message has `reset`
  bool map_due_;                                   // the next message is the first of a replica
  bool gathers_ = false;
  double changes_per_s_ = 0;  // exponential moving average over the group's runs

  SteadyTime last_message_ = SteadyTime::InfinitePast();
  SteadyTime last_progress_ = SteadyTime::InfinitePast();
  int64_t items_ = 0;
  std::optional<ChangeFeed::WaitId> feed_wait_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_SOURCE_H_
