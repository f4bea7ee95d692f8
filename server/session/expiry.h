// The schedule by which objects with a time to live are removed.
#ifndef HYPERMAP_SERVER_SESSION_EXPIRY_H_
#define HYPERMAP_SERVER_SESSION_EXPIRY_H_

#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/time/time.h"
#include "map/edits/change.h"
#include "map/edits/edit.h"
#include "map/snapshot.h"

namespace hypermap::server {

// An index of the objects of the newest snapshot that expire, by their time. Each change costs
// O(log n) of those objects. Not thread safe.
class ExpirySchedule {
 public:
  explicit ExpirySchedule(const Snapshot& snapshot);

  // Takes account of a commit. REQUIRES: commits come in order, and none is left out.
  void Update(const std::vector<Change>& changes);

  // The time at which the next object expires; InfiniteFuture if there is none.
  absl::Time next() const;

  // The edits that delete the objects that expire at `now` or before, the earliest first, at most
  // `max_edits`. The schedule changes when Update is called with their commit.
  EditBatch Due(absl::Time now, size_t max_edits) const;

 private:
  using Key = std::pair<std::string, ObjectId>;  // layer, object

  void Set(const std::string& layer, const SemanticObject& object);
  void Remove(const std::string& layer, ObjectId id);
  void RemoveLayer(const std::string& layer);

  // The same entries twice: a renewal is found by object, the next expiry by time.
  std::map<Key, absl::Time> ends_;
  std::set<std::pair<absl::Time, Key>> by_end_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_EXPIRY_H_
