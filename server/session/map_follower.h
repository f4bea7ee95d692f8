// Follows a map that another server writes.
#ifndef HYPERMAP_SERVER_SESSION_MAP_FOLLOWER_H_
#define HYPERMAP_SERVER_SESSION_MAP_FOLLOWER_H_

#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "map/snapshot.h"
#include "server/session/change_feed.h"
#include "storage/map_store.h"

namespace hypermap::server {

// Reads the commits of the owner from the store, in their order, and carries them out on the
// snapshots: a follower has the same snapshots and the same feed as the owner. Used by one thread.
class MapFollower {
 public:
  // `stored` must live until Close.
  explicit MapFollower(storage::StoredMap* stored) : stored_(stored) {}

  struct Steps {
    SnapshotPtr snapshot;             // after the commits
    std::vector<FeedCommit> commits;  // none if there was nothing new
  };
  // Reads some of the commits after a snapshot. UNAVAILABLE, and OUT_OF_RANGE if the store does not
  // keep them any more, so that the map has to be loaded again; DATA_LOSS if they don't fit to it.
  absl::StatusOr<Steps> Read(const SnapshotPtr& from);

  // Closes what is open in `stored`, which need not live any longer. REQUIRES: no more Read.
  void Close() { reader_.reset(); }

 private:
  storage::StoredMap* const stored_;
  std::unique_ptr<storage::HistoryReader> reader_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_MAP_FOLLOWER_H_
