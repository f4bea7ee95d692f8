// Encodes each commit once for all watches with the same filter.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_GROUP_H_
#define HYPERMAP_SERVER_WATCH_WATCH_GROUP_H_

#include <grpcpp/support/slice.h>

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "base/limits/limits.h"
#include "base/sync/mutex.h"
#include "map/watch/follower.h"
#include "server/rpc/facilities.h"
#include "server/session/change_feed.h"
#include "server/watch/watch_tuning.h"

namespace hypermap::server {

// A ring with the encoded messages of a map's newest commits, shared by all watches of the map with
// one filter. The first watch that reaches a commit encodes its message; the others copy a
// reference to the bytes. The ring has one entry for each commit from its first to its last, so
// that an entry is found by its revision: also for commits that select nothing, and for commits
// that each watch must encode by itself because they change the map's structure, take several
// messages, or take long to compare with the filter.
//
// Thread safe. The lock is held while messages are encoded, because a thread that waits for it
// would otherwise encode the same ones; for little more than WatchTuning::max_encoding.
class WatchGroup {
 public:
  // Consecutive commits, and the message that reports them.
  struct Run {
    Revision end = 0;          // the last commit
    Revision told = 0;         // the last commit that selects something; 0: none does
    grpc::Slice message;       // WatchMessage; empty if no commit selects anything
    int64_t num_changes = 0;   // in the message
    bool reaches_end = false;  // kCoalesced: `end` was the newest revision when the run was made
  };

  // A run has the message of one commit, or of many in the field `coalesced`.
  enum class Form { kSingle, kCoalesced };

  // `incarnation` is that of the feed's map. `feed` and `bytes_of_all` must outlive this;
  // `bytes_of_all` counts the bytes in the rings of all groups.
  WatchGroup(const ChangeFeed* feed, uint64_t incarnation, const Limits& limits,
             const WatchTuning& tuning, std::atomic<int64_t>* bytes_of_all);
  ~WatchGroup();
  WatchGroup(const WatchGroup&) = delete;
  WatchGroup& operator=(const WatchGroup&) = delete;

  // Returns a run of at least one commit after `after`, for a watch whose cursor is at `after`.
  // `structure` is the map's at `after`. `follower` has the group's filter and is at `structure`;
  // it filters the commits that no watch has encoded yet. nullopt if there is no next commit, or if
  // the watch has to encode it by itself.
  //
  // A coalesced run ends no later than the newest one that was returned, until the watch has
  // reached that one's end. So watches that come at about the same time get the same bytes, and
  // have the same cursor the next time.
  std::optional<Run> Take(Revision after, const StructurePtr& structure, Follower& follower,
                          Form form);

 private:
  struct Entry {
    StructurePtr structure;  // the map's after the commit
    grpc::Slice message;     // empty: the commit selects nothing
    int64_t num_changes = 0;
    bool alone = false;  // each watch must encode the commit by itself
  };
  // The newest coalesced run and the cursor that it starts from.
  struct Newest {
    Revision after = -1;
    StructurePtr structure;
    Run run;
  };

  std::optional<Run> TakeCoalesced(Revision after, const StructurePtr& structure,
                                   Follower& follower) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Makes a run of the entries after `after` and up to `end`, with at most `max_messages` messages.
  std::optional<Run> Collect(Revision after, const StructurePtr& structure, Revision end,
                             size_t max_messages) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Appends entries for commits of the feed, as far as `follower` can filter them: until the
  // structure is not `structure` any more, or the time for encoding is over.
  void Extend(Revision after, const StructurePtr& structure, Follower& follower)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // The commits after the last entry. Empties the ring and restarts it at `after` if the feed no
  // longer has the commits between its end and `after`, or if they are too many to encode.
  std::vector<FeedCommit> ReadOn(Revision after) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // If IsCancelled(), returns any entry.
  Entry Encode(const FeedCommit& commit, Follower& follower) const;
  void Push(Entry entry) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void PopFirst() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void BeginAfter(Revision after) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Revision first() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return last_ + 1 - static_cast<Revision>(entries_.size());
  }

  const ChangeFeed* const feed_;
  const uint64_t incarnation_;
  const Limits limits_;
  const WatchTuning tuning_;
  std::atomic<int64_t>* const bytes_of_all_;

  Mutex mutex_;
  std::deque<Entry> entries_ ABSL_GUARDED_BY(mutex_);
  // Revision of the last entry; of an empty ring, the revision before the next one.
  Revision last_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t bytes_ ABSL_GUARDED_BY(mutex_) = 0;  // sum of BytesOf(entries_)
  Newest newest_ ABSL_GUARDED_BY(mutex_);
};

// The groups of a server. A group is destroyed with its last watch. Must outlive its groups. Thread
// safe.
class WatchGroups {
 public:
  explicit WatchGroups(const Limits& limits, const WatchTuning& tuning = {})
      : limits_(limits), tuning_(tuning) {}

  // Returns the group of all watches of `feed`, which is that of a map of this incarnation, with
  // this filter. The caller must keep the feed alive for longer than the group. Linear in the
  // number of groups.
  std::shared_ptr<WatchGroup> Join(const ChangeFeed* feed, uint64_t incarnation,
                                   const WatchFilter& filter);

 private:
  struct Known {
    const ChangeFeed* feed;
    WatchFilter filter;
    std::weak_ptr<WatchGroup> group;
  };

  const Limits limits_;
  const WatchTuning tuning_;
  std::atomic<int64_t> bytes_ = 0;
  Mutex mutex_;
  std::vector<Known> groups_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_GROUP_H_
