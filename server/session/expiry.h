// When objects leave a map by themselves.
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

// The objects of the newest snapshot that have an end, by it. One thread.
class ExpirySchedule {
 public:
  explicit ExpirySchedule(const Snapshot& snapshot);

  // Follows a commit.
  void Update(const std::vector<Change>& changes);

  // When the next object is to leave; InfiniteFuture when none has an end.
  absl::Time next() const;

  // The edits that remove what is to leave at `now` or before, the earliest first, at most so many.
  EditBatch Due(absl::Time now, size_t max_edits) const;

 private:
  using Key = std::pair<std::string, ObjectId>;  // layer, object

  void Set(const std::string& layer, const SemanticObject& object);
  void Remove(const std::string& layer, ObjectId id);
  void RemoveLayer(const std::string& layer);

  std::map<Key, absl::Time> ends_;
  std::set<std::pair<absl::Time, Key>> by_end_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_EXPIRY_H_
