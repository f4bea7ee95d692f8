// The messages of a Watch rpc.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_SOURCE_H_
#define HYPERMAP_SERVER_WATCH_WATCH_SOURCE_H_

#include <grpcpp/support/slice.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/watch/follower.h"
#include "server/rpc/facilities.h"
#include "server/session/map_session.h"
#include "server/watch/watch_group.h"

namespace hypermap::server {

// Follows a map commit by commit. Messages of the newest come from the group of those who watch
// alike; it makes by itself what the group can't share: its snapshot, commits that change the map's
// structure or are large, and what it reads from the map's history because the feed does not have
// it any more. Between calls it holds a place in the map's revisions and what is to be told of one
// of them. One thread at a time.
class WatchSource {
 public:
  enum class Step { kMessage, kNothingYet, kNothingNew };

  // `groups` outlives the source. Errors are those of the rpc.
  static absl::StatusOr<std::unique_ptr<WatchSource>> Open(const Facilities& facilities,
                                                           WatchGroups* groups,
                                                           const v1::WatchRequest& request);

  // Makes the bytes of a WatchResponse, or does a bounded amount of work towards it. kNothingNew:
  // until there is a revision after taken(), or for idle_for(now). UNAVAILABLE when the feed is
  // closed, OUT_OF_RANGE when what is to be told is not kept any more, RESOURCE_EXHAUSTED for a
  // reader that fell too far behind; all name the revision to resume from.
  absl::StatusOr<Step> Next(absl::Time now, grpc::Slice* message);

  // Makes the message of what comes next, if the group can; only waits for others of the group.
  bool TakeShared(absl::Time now, grpc::Slice* message);

  // Whether the next message had better wait until several have gathered: the last was of all that
  // there was, and the caller asked to have them together.
  bool gathers() const { return gathers_; }
  // Whether so much is told that they had better gather for longer.
  bool is_busy() const { return changes_per_s_ > kBusyChangesPerS; }

  ChangeFeed& feed() const { return session_->feed(); }
  Revision taken() const { return taken_; }
  absl::Duration idle_for(absl::Time now) const;
  // Changes in the messages so far.
  int64_t items() const { return items_; }

 private:
  static constexpr double kBusyChangesPerS = 1500;

  WatchSource(const ServiceLimits& limits, std::shared_ptr<MapSession> session,
              std::shared_ptr<WatchGroup> group, WatchGroup::Form form, Follower follower,
              SnapshotPtr structure, Revision start, bool as_stored);

  // The structure of the map at a revision to start from.
  static absl::StatusOr<SnapshotPtr> StructureAt(MapSession& session, Revision revision);
  // When a kept revision was made, 0: the map. OUT_OF_RANGE.
  static absl::StatusOr<absl::Time> TimeOf(MapSession& session, Revision revision);
  // ABORTED unless the revision to start from is the one that the caller knows.
  static absl::Status CheckStart(MapSession& session, const v1::WatchRequest& request);

  // Tells the selection at `snapshot` next.
  absl::Status BeginSelection(SnapshotPtr snapshot, bool reset);
  Step ReadSelection(absl::Time now, grpc::Slice* message);
  absl::StatusOr<Step> TakeCommits(absl::Time now, grpc::Slice* message);
  // By itself.
  absl::StatusOr<Step> TakeCommit(absl::Time now, grpc::Slice* message);
  // Fills commits_ with what is published up to `newest`.
  absl::Status ReadCommits(Revision newest);
  Step TellNext(absl::Time now, grpc::Slice* message);
  Step TellRun(absl::Time now, const WatchGroup::Run& run, grpc::Slice* message);
  absl::StatusOr<Step> TellProgress(absl::Time now, grpc::Slice* message);
  // When a message without changes is due.
  absl::Time ProgressDue() const;
  absl::Status WithResume(const absl::Status& status) const;

  const ServiceLimits limits_;
  const std::shared_ptr<MapSession> session_;
  const std::shared_ptr<WatchGroup> group_;  // of session_'s feed
  const WatchGroup::Form form_;
  const bool as_stored_;
  Follower follower_;
  SnapshotPtr structure_;  // at taken_, and the follower's

  Revision taken_;                  // all up to here went through a follower
  Revision told_;                   // all up to here is in messages
  int64_t max_lag_;                 // newest revision - taken_
  std::deque<FeedCommit> commits_;  // after taken_

  // What is being told, of the revision taken_: a part of the selection, or a commit's changes.
  std::vector<ToldChange> telling_;
  size_t next_ = 0;
  FeedCommit commit_;                           // of telling_, without its changes; of a selection
                                                // that is told as stored, the time
  std::unique_ptr<SelectionReader> selection_;  // null: a commit
  bool selection_resets_ = false;
  bool map_told_ = false;  // of as_stored_
  bool gathers_ = false;
  double changes_per_s_ = 0;  // of runs; a mean in which what is old fades

  absl::Time last_message_ = absl::InfinitePast();
  absl::Time last_progress_ = absl::InfinitePast();
  int64_t items_ = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_SOURCE_H_
