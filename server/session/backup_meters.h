// Counts what scheduled backups have done since the server was started.
#ifndef HYPERMAP_SERVER_SESSION_BACKUP_METERS_H_
#define HYPERMAP_SERVER_SESSION_BACKUP_METERS_H_

#include <cstdint>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"

namespace hypermap::server {

// Thread safe.
class BackupMeters {
 public:
  struct OfMap {
    int64_t verified = 0;
    int64_t failed = 0;
    absl::Time newest = absl::InfinitePast();  // time of the newest verified backup
  };

  void AddVerified(const std::string& map, absl::Time time) {
    const MutexLock lock(&mutex_);
    OfMap& of_map = maps_[map];
    ++of_map.verified;
    of_map.newest = time;
  }
  void AddFailed(const std::string& map) {
    const MutexLock lock(&mutex_);
    ++maps_[map].failed;
  }
  std::map<std::string, OfMap> Read() const {
    const MutexLock lock(&mutex_);
    return maps_;
  }

 private:
  mutable Mutex mutex_;
  std::map<std::string, OfMap> maps_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_BACKUP_METERS_H_
