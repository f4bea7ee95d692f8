// Those who watch alike.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_GROUP_H_
#define HYPERMAP_SERVER_WATCH_WATCH_GROUP_H_

#include <grpcpp/support/slice.h>

#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/watch/follower.h"
#include "server/rpc/facilities.h"
#include "server/session/change_feed.h"

namespace hypermap::server {

// The watches of one map with one filter, and the messages of the newest commits for all of them:
// each is made once, by the first who comes to it, and lies in a ring. The ring has an entry for
// each commit from its first to its last, also for those that select nothing, and those that each
// watch tells by itself: commits that change the map's structure, or take several messages.
//
// Thread safe. The lock is held while messages are made: who waits for it would otherwise make the
// same ones.
class WatchGroup {
 public:
  struct Limits {
    int64_t max_commits = 4096;
    // Of a ring, and of the rings of all groups together.
    int64_t max_bytes = int64_t{4} << 20;
    int64_t max_bytes_of_all = int64_t{64} << 20;
  };

  // Some commits that follow one another.
  struct Run {
    Revision end = 0;          // the last of them
    Revision told = 0;         // the last of which there is a message; 0: none
    grpc::Slice message;       // WatchResponse; empty when they select nothing
    int64_t num_changes = 0;   // in the message
    bool reaches_end = false;  // kCoalesced: there was nothing after it when it was made
  };

  // How many messages are in one.
  enum class Form { kSingle, kCoalesced };

  // Both outlive this; `bytes_of_all` counts what the rings of all groups hold.
  WatchGroup(const ChangeFeed* feed, const ServiceLimits& service_limits, const Limits& limits,
             std::atomic<int64_t>* bytes_of_all);
  ~WatchGroup();
  WatchGroup(const WatchGroup&) = delete;
  WatchGroup& operator=(const WatchGroup&) = delete;

  // The commits after `after`, at least one, for a watch that has told all up to there.
  // `structure` is the map's at `after`, and `follower`, which has the group's filter, is there
  // too; it makes what nobody has made yet. nullopt: there is no next one, or the watch has to tell
  // it by itself.
  //
  // Coalesced runs end where others end that were taken since, so that those who come at about the
  // same time get the same bytes, and are at the same place the next time.
  std::optional<Run> Take(Revision after, const SnapshotPtr& structure, Follower& follower,
                          Form form);

 private:
  struct Entry {
    SnapshotPtr structure;  // after the commit
    grpc::Slice message;    // empty: selects nothing
    int64_t num_changes = 0;
    bool alone = false;  // each tells it by itself
  };
  // The coalesced run that was taken last of those that went furthest.
  struct Newest {
    Revision after = -1;
    SnapshotPtr structure;
    Run run;
  };

  std::optional<Run> TakeCoalesced(Revision after, const SnapshotPtr& structure, Follower& follower)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // From entries after `after` and up to `end`, with at most so many messages.
  std::optional<Run> Collect(Revision after, const SnapshotPtr& structure, Revision end,
                             size_t max_messages) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Adds entries from the feed, where `follower` can make them.
  void Extend(Revision after, const SnapshotPtr& structure, Follower& follower)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // The commits after the last entry; the ring begins anew after `after` when it can't be
  // continued up to there.
  std::vector<FeedCommit> ReadOn(Revision after) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Entry Encode(const FeedCommit& commit, Follower& follower) const;
  void Push(Entry entry) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void PopFirst() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void BeginAfter(Revision after) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Revision first() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return last_ + 1 - static_cast<Revision>(entries_.size());
  }

  const ChangeFeed* const feed_;
  const ServiceLimits service_limits_;
  const Limits limits_;
  std::atomic<int64_t>* const bytes_of_all_;

  Mutex mutex_;
  std::deque<Entry> entries_ ABSL_GUARDED_BY(mutex_);
  Revision last_ ABSL_GUARDED_BY(mutex_) = 0;  // of entries_; empty: that before the first to come
  int64_t bytes_ ABSL_GUARDED_BY(mutex_) = 0;  // of entries_
  Newest newest_ ABSL_GUARDED_BY(mutex_);
};

// The groups of a server; one is gone with its last watch. Outlives them. Thread safe.
class WatchGroups {
 public:
  explicit WatchGroups(const ServiceLimits& service_limits, const WatchGroup::Limits& limits = {})
      : service_limits_(service_limits), limits_(limits) {}

  // The group of those who follow `feed` with the filter of `request`. The caller keeps the feed
  // for longer than the group.
  std::shared_ptr<WatchGroup> Join(const ChangeFeed* feed, v1::WatchRequest request);

 private:
  using Key = std::pair<const ChangeFeed*, std::string>;  // a request's bytes, without its start

  const ServiceLimits service_limits_;
  const WatchGroup::Limits limits_;
  std::atomic<int64_t> bytes_ = 0;
  Mutex mutex_;
  std::map<Key, std::weak_ptr<WatchGroup>> groups_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_GROUP_H_
