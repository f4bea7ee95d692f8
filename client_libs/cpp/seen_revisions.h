// The revisions that a client has seen. Only for the sources of this folder.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_SEEN_REVISIONS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_SEEN_REVISIONS_H_

#include <cstdint>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "base/sync/mutex.h"
#include "map/snapshot.h"

namespace hypermap::client {

// A revision of a map, and the incarnation to which it belongs; {0, 0}: none.
struct SeenRevision {
  uint64_t incarnation = 0;
  Revision revision = 0;

  // Returns whether this is an earlier revision of the same incarnation.
  bool IsBefore(const SeenRevision& other) const {
    return incarnation == other.incarnation && revision < other.revision;
  }
};

// The newest revision at which an answer was read, if it names one.
template <typename Response>
SeenRevision NewestIn(const Response& response) {
  if constexpr (requires { response.newest_revision() + response.incarnation(); }) {
    return {response.incarnation(), response.newest_revision()};
  } else if constexpr (requires { response.revision() + response.incarnation(); }) {
    return {response.incarnation(), response.revision()};
  } else if constexpr (requires { response.map().revision() + response.map().incarnation(); }) {
    return {response.map().incarnation(), response.map().revision()};
  } else {
    return {};
  }
}

// Remembers for each map the newest revision that an answer or a watch has named, so that a client
// sees its own changes, and never goes back in time, whichever of several servers it asks. Queries
// carry it, and no server answers them with less; other answers with less are not taken. Thread
// safe.
class SeenRevisions {
 public:
  // Ignored without an incarnation: the revision then means nothing in another answer.
  void Note(const std::string& map, const SeenRevision& newest) {
    if (newest.incarnation == 0) return;
    const MutexLock lock(&mutex_);
    SeenRevision& seen = maps_[map];
    // Another incarnation begins anew, even with a smaller revision.
    if (seen.incarnation != newest.incarnation || seen.IsBefore(newest)) seen = newest;
  }

  SeenRevision Find(const std::string& map) const {
    const MutexLock lock(&mutex_);
    const auto found = maps_.find(map);
    return found == maps_.end() ? SeenRevision() : found->second;
  }

 private:
  mutable Mutex mutex_;
  absl::flat_hash_map<std::string, SeenRevision> maps_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_SEEN_REVISIONS_H_
