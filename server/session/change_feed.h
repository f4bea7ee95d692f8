// The newest commits of a map, for its watches and for calls that wait for a revision.
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
#include "map/structure.h"
#include "server/session/feed_memory.h"

namespace hypermap::server {

// A commit as subscribers get it. Cheap to copy: changes and structure are shared.
struct FeedCommit {
  Revision revision = 0;
  absl::Time time;
  std::string author;
  std::shared_ptr<const std::vector<Change>> changes;
  // The map without content (map/watch/structure.h) after the commit. The same pointer as the
  // commit before has if this one changed content only.
  StructurePtr structure;
};

// A ring of whole commits, bounded by their number and their memory. The oldest are dropped;
// readers find them in the map's history. The feed keeps no state of its readers except the
// callbacks of waiting ones, so that a slow reader delays neither the writer nor other readers.
// Thread safe; no lock is held while a callback runs.
class ChangeFeed {
 public:
  struct Limits {
    int64_t max_commits = 4096;
    // Bound of memory in bytes: of the changes, with the content before and after them, and of what
    // the structure of each commit does not share with that of the commit before.
    int64_t max_bytes = int64_t{64} << 20;
    // Counts the memory of this feed together with that of others.
    std::shared_ptr<FeedMemory> of_all = std::make_shared<FeedMemory>();
  };

  // A feed without commits, of a map whose newest revision is `revision`. `structure` is the map's
  // at that revision.
  ChangeFeed(Revision revision, StructurePtr structure, const Limits& limits);
  ~ChangeFeed();
  ChangeFeed(const ChangeFeed&) = delete;
  ChangeFeed& operator=(const ChangeFeed&) = delete;

  // Adds the commits that follow the newest one, and fills in their structures. Calls no callback:
  // Wake must follow. REQUIRES: revisions are consecutive.
  void Append(std::vector<FeedCommit> commits);
  // Calls the callbacks that wait for commits which were appended. A step of its own, because there
  // may be thousands of callbacks, which the answers to the authors of the commits need not wait
  // for.
  void Wake();

  Revision newest() const;
  // Bytes that the kept commits take, at most max_bytes.
  int64_t bytes() const;

  // Returns the commits after `after`, in order: as many as have at most `max_changes` changes
  // together, but at least one. Empty if `after` is the newest; nullopt if the feed does not reach
  // back that far.
  std::optional<std::vector<FeedCommit>> Read(Revision after, int64_t max_changes) const;

  // The structure of the map at `revision`; nullopt if the feed does not reach back that far, or if
  // there is no such revision yet.
  std::optional<StructurePtr> StructureAt(Revision revision) const;

  using Callback = absl::AnyInvocable<void() &&>;
  using WaitId = int64_t;
  // Calls `callback` once, as soon as there is a revision after `after` or the feed is closed: at
  // once, or later on the thread that calls Wake or closes the feed.
  WaitId Await(Revision after, Callback callback);
  // Drops a callback that was not called yet. A call may already be under way on another thread.
  void Remove(WaitId id);

  // Calls all waiting callbacks, and from now on each new one at once, so that watches end. Commits
  // may still be added and read.
  void Close();
  bool closed() const;

 private:
  struct Waiter {
    Revision after;
    Callback callback;
  };

  // Removes and returns the callbacks that are due, for the caller to run without the lock.
  std::vector<Callback> TakeDue() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void AddBytes(int64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Drops the oldest commits until the limits are kept.
  void Trim() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Limits limits_;

  mutable Mutex mutex_;
  std::deque<FeedCommit> commits_ ABSL_GUARDED_BY(mutex_);
  std::deque<int64_t> sizes_ ABSL_GUARDED_BY(mutex_);  // of commits_, in bytes
  int64_t bytes_ ABSL_GUARDED_BY(mutex_) = 0;          // the sum of sizes_
  Revision newest_ ABSL_GUARDED_BY(mutex_);
  // The structures before the first of commits_ and after the last.
  StructurePtr oldest_structure_ ABSL_GUARDED_BY(mutex_);
  StructurePtr newest_structure_ ABSL_GUARDED_BY(mutex_);
  std::map<WaitId, Waiter> waiters_ ABSL_GUARDED_BY(mutex_);
  WaitId next_id_ ABSL_GUARDED_BY(mutex_) = 1;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_CHANGE_FEED_H_
