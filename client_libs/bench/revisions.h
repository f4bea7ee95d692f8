// Bookkeeping of the revisions that clients receive.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_REVISIONS_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_REVISIONS_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "map/snapshot.h"

namespace hypermap::bench {

// A set of revisions after a first one, one bit for each. Not thread safe.
class RevisionSet {
 public:
  // The set can have the revisions greater than `after`.
  explicit RevisionSet(Revision after) : after_(after) {}

  // Returns whether the revision is new. Revisions up to `after` are not kept, and count as new.
  bool Add(Revision revision);
  bool Has(Revision revision) const;
  Revision after() const { return after_; }
  // The largest revision; `after` if there is none.
  Revision last() const { return after_ + static_cast<Revision>(has_.size()); }
  int64_t size() const { return size_; }
  // Number of revisions of `expected` that this set does not have.
  int64_t CountMissing(const RevisionSet& expected) const;

 private:
  const Revision after_;
  std::vector<bool> has_;  // of the revision after_ + 1 + index
  int64_t size_ = 0;
};

// Errors of a watch. A revision that never came is found at the end, by comparison with the
// revisions that the server lists (RevisionSet::CountMissing).
struct WatchFaults {
  int64_t repeated = 0;   // a revision came again
  int64_t reordered = 0;  // an event was older than one before it, or refused for its order
};

// Checks the events of one watch, which may break and resume. Thread safe.
class WatchTrack {
 public:
  // The watch reports the changes after `start`.
  explicit WatchTrack(Revision start) : last_(start), seen_(start) {}

  // Call it for each event, with the revision and whether the event has changes. An event without
  // changes tells how far the watch is, and may name the revision of the event before it.
  void Note(Revision revision, bool has_changes);

  // Call it if the client library has ended the watch because of the order of its messages.
  void NoteRefusal();

  // The revision that the watch has reached.
  Revision last() const;
  WatchFaults faults() const;
  int64_t num_seen() const;
  int64_t CountMissing(const RevisionSet& expected) const;

 private:
  mutable Mutex mutex_;
  Revision last_ ABSL_GUARDED_BY(mutex_);
  RevisionSet seen_ ABSL_GUARDED_BY(mutex_);  // those with changes
  WatchFaults faults_ ABSL_GUARDED_BY(mutex_);
};

// The times at which revisions were made, by the server's clock, as watchers learn them. Thread
// safe.
class RevisionTimes {
 public:
  // For the revisions after `start`.
  explicit RevisionTimes(Revision start) : start_(start) {}

  // A watcher was told of the revision. Absent time: the watcher has reached it, and was told no
  // time, because the revision has no changes.
  void Note(Revision revision, std::optional<absl::Time> time);
  // Returns whether the time of the revision is known, or it is known to have none.
  bool IsSettled(Revision revision) const;
  std::optional<absl::Time> TimeOf(Revision revision) const;

 private:
  const Revision start_;
  mutable Mutex mutex_;
  // The time of the revision start_ + 1 + index; InfinitePast if it has none.
  std::vector<absl::Time> times_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_REVISIONS_H_
