// The messages of a Watch rpc.
#ifndef HYPERMAP_SERVER_SERVICES_WATCH_SOURCE_H_
#define HYPERMAP_SERVER_SERVICES_WATCH_SOURCE_H_

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/watch/follower.h"
#include "server/services/facilities.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// Follows a map commit by commit: from the session's feed, and from the map's history what the feed
// does not have any more. Between calls it holds a place in the map's revisions and what is to be
// told of one of them. One thread at a time.
class WatchSource {
 public:
  enum class Step { kMessage, kNothingYet, kNothingNew };

  // Errors are those of the rpc.
  static absl::StatusOr<std::unique_ptr<WatchSource>> Open(const Facilities& facilities,
                                                           const v1::WatchRequest& request);

  // Fills the empty message, or does a bounded amount of work towards it. kNothingNew: until there
  // is a revision after taken(), or for idle_for(now). UNAVAILABLE when the feed is closed,
  // OUT_OF_RANGE when what is to be told is not kept any more, RESOURCE_EXHAUSTED for a reader that
  // fell too far behind; all name the revision to resume from.
  absl::StatusOr<Step> Next(absl::Time now, v1::WatchResponse* message);

  ChangeFeed& feed() const { return session_->feed(); }
  Revision taken() const { return taken_; }
  absl::Duration idle_for(absl::Time now) const;
  // Changes in the messages so far.
  int64_t items() const { return items_; }

 private:
  WatchSource(const ServiceLimits& limits, std::shared_ptr<MapSession> session, Follower follower,
              SnapshotPtr structure, Revision start);

  // The structure of the map at a revision to start from.
  static absl::StatusOr<SnapshotPtr> StructureAt(MapSession& session, Revision revision);

  void BeginSelection(SnapshotPtr snapshot, bool reset);
  Step ReadSelection(absl::Time now, v1::WatchResponse* message);
  absl::StatusOr<Step> TakeCommit(absl::Time now, v1::WatchResponse* message);
  // Fills commits_, where there is something new.
  absl::Status ReadCommits();
  Step TellNext(absl::Time now, v1::WatchResponse* message);
  Step TellProgress(absl::Time now, v1::WatchResponse* message);
  // When a message without changes is due.
  absl::Time ProgressDue() const;
  absl::Status WithResume(const absl::Status& status) const;

  const ServiceLimits limits_;
  const std::shared_ptr<MapSession> session_;
  Follower follower_;
  SnapshotPtr structure_;  // at taken_

  Revision taken_;                  // all up to here went through the follower
  Revision told_;                   // all up to here is in messages
  int64_t max_lag_;                 // newest revision - taken_
  std::deque<FeedCommit> commits_;  // after taken_

  // What is being told, of the revision taken_: a part of the selection, or a commit's changes.
  std::vector<ToldChange> telling_;
  size_t next_ = 0;
  FeedCommit commit_;                           // of telling_; without its changes
  std::unique_ptr<SelectionReader> selection_;  // null: a commit
  bool selection_resets_ = false;

  absl::Time last_message_ = absl::InfinitePast();
  absl::Time last_progress_ = absl::InfinitePast();
  int64_t items_ = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_WATCH_SOURCE_H_
