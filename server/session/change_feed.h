// The newest commits of a map, for those who follow it.
#ifndef HYPERMAP_SERVER_SESSION_CHANGE_FEED_H_
#define HYPERMAP_SERVER_SESSION_CHANGE_FEED_H_

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "map/edits/change.h"
#include "map/snapshot.h"

namespace hypermap::server {

// What followers are told of a commit; all of it is shared.
struct FeedCommit {
  Revision revision = 0;
  absl::Time time;
  std::string author;
  std::shared_ptr<const std::vector<Change>> changes;
  // The map without content (map/watch/structure.h) after the commit; the same pointer as before
  // when the commit changed content only.
  SnapshotPtr structure;
};

// A ring of whole commits, bounded by their number and by what they hold in memory: the oldest go,
// and are in the map's history. Knows nothing of its readers but whom to wake, so that a slow one
// holds nobody up. Thread safe; no lock is held while a callback runs.
class ChangeFeed {
 public:
  struct Limits {
    int64_t max_commits = 4096;
    // An object weighs 1, a tile as many objects as take its place in memory.
    int64_t max_weight = 65536;
  };

  // Of a map at `revision`, which is the newest. `structure` is the map's without content.
  ChangeFeed(Revision revision, SnapshotPtr structure, const Limits& limits);
  ChangeFeed(const ChangeFeed&) = delete;
  ChangeFeed& operator=(const ChangeFeed&) = delete;

  // Adds the commits that follow the newest; their structures are filled in here. Wakes those who
  // wait for them.
  void Append(std::vector<FeedCommit> commits);

  Revision newest() const;

  // The commits after `after`, in order, until they have `max_changes` changes together, but at
  // least one; none when `after` is the newest. nullopt when they do not reach back that far.
  std::optional<std::vector<FeedCommit>> Read(Revision after, int64_t max_changes) const;

  // The structure of the map at `revision`. nullopt when it does not reach back that far, or
  // forward.
  std::optional<SnapshotPtr> StructureAt(Revision revision) const;

  using Callback = absl::AnyInvocable<void() &&>;
  using WaitId = int64_t;
  // Calls `callback` once when there is a revision after `after` or the feed is closed: at once, or
  // on the thread that makes it so.
  WaitId Await(Revision after, Callback callback);
  // Forgets a callback that was not called yet; it may be under way.
  void Remove(WaitId id);

  // Tells all who wait that they had better go. Commits may still be added and read.
  void Close();
  bool closed() const;

 private:
  struct Waiter {
    Revision after;
    Callback callback;
  };

  // The callbacks that are due.
  std::vector<Callback> TakeDue() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Trim() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Limits limits_;

  mutable Mutex mutex_;
  std::deque<FeedCommit> commits_ ABSL_GUARDED_BY(mutex_);
  std::deque<int64_t> weights_ ABSL_GUARDED_BY(mutex_);  // of commits_
  int64_t weight_ ABSL_GUARDED_BY(mutex_) = 0;
  Revision newest_ ABSL_GUARDED_BY(mutex_);
  // Before the first of commits_, and after the last.
  SnapshotPtr oldest_structure_ ABSL_GUARDED_BY(mutex_);
  SnapshotPtr newest_structure_ ABSL_GUARDED_BY(mutex_);
  std::map<WaitId, Waiter> waiters_ ABSL_GUARDED_BY(mutex_);
  WaitId next_id_ ABSL_GUARDED_BY(mutex_) = 1;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_CHANGE_FEED_H_
