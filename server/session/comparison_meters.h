// Counts the comparisons of maps with the store since the server was started.
#ifndef HYPERMAP_SERVER_SESSION_COMPARISON_METERS_H_
#define HYPERMAP_SERVER_SESSION_COMPARISON_METERS_H_

#include <cstdint>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "base/sync/mutex.h"

namespace hypermap::server {

// Thread safe.
class ComparisonMeters {
 public:
  struct OfMap {
    int64_t equal = 0;
    int64_t different = 0;
    int64_t failed = 0;  // the store could not be read
  };

  void AddEqual(const std::string& map) { Add(map, &OfMap::equal); }
  void AddDifferent(const std::string& map) { Add(map, &OfMap::different); }
  void AddFailed(const std::string& map) { Add(map, &OfMap::failed); }
  std::map<std::string, OfMap> Read() const {
    const MutexLock lock(&mutex_);
    return maps_;
  }

 private:
  void Add(const std::string& map, int64_t OfMap::*count) {
    const MutexLock lock(&mutex_);
    ++(maps_[map].*count);
  }

  mutable Mutex mutex_;
  std::map<std::string, OfMap> maps_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_COMPARISON_METERS_H_
