// The schedule by which objects with a time to live are removed.
//
// Ends are values of MapTime::Lived, because the wall clock may be set.
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
#include "server/session/map_time.h"

namespace hypermap::server {

// An index of the objects of the newest snapshot that expire, by their time. Each change costs
// O(log n) of those objects. Not thread safe.
class ExpirySchedule {
 public:
  // `time` must outlive this.
  ExpirySchedule(const Snapshot& snapshot, const MapTime* time);

  // Takes account of a commit. REQUIRES: commits come in order, and none is left out.
  void Update(const std::vector<Change>& changes);

  // The end of the object that expires next; infinite if there is none.
  absl::Duration next() const;

  // The edits that delete the objects whose end is at `lived` or before, the earliest first, at
  // most `max_edits`. The schedule changes when Update is called with their commit.
  EditBatch Due(absl::Duration lived, size_t max_edits) const;

 private:
  using Key = std::pair<std::string, ObjectId>;  // layer, object

  void Set(const std::string& layer, const SemanticObject& object);
  void Remove(const std::string& layer, ObjectId id);
  void RemoveLayer(const std::string& layer);

  // The same entries twice: a renewal is found by object, the next expiry by time.
  std::map<Key, absl::Duration> ends_;
  std::set<std::pair<absl::Duration, Key>> by_end_;
  const MapTime* const time_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_EXPIRY_H_
