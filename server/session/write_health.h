// Whether the store takes the changes of a map.
#ifndef HYPERMAP_SERVER_SESSION_WRITE_HEALTH_H_
#define HYPERMAP_SERVER_SESSION_WRITE_HEALTH_H_

#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"

namespace hypermap::server {

// Goes by the newest attempt to write. After a failed one a trial write is due, at first after
// kFirstTrial, and after each that fails as well in twice the time, at most kLastTrial. A map to
// which nobody writes thus tells that its disk has room again. Logs when writing begins to fail and
// when it succeeds again. Thread safe.
class WriteHealth {
 public:
  static constexpr absl::Duration kFirstTrial = absl::Seconds(1);
  static constexpr absl::Duration kLastTrial = absl::Seconds(10);

  explicit WriteHealth(std::string map) : map_(std::move(map)) {}

  // Notes the result of a write, `now` by any clock that never goes back. An error that is the
  // caller's, because it gave up, says nothing about the store.
  void Note(const absl::Status& written, absl::Duration now);

  // Why the newest write failed; OK if it succeeded or there was none.
  absl::Status problem() const;
  // The time of the next trial; infinite if none is due.
  absl::Duration next_trial() const;

 private:
  const std::string map_;
  mutable Mutex mutex_;
  absl::Status problem_ ABSL_GUARDED_BY(mutex_);
  absl::Duration pause_ ABSL_GUARDED_BY(mutex_) = kFirstTrial;
  absl::Duration next_trial_ ABSL_GUARDED_BY(mutex_) = absl::InfiniteDuration();
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_WRITE_HEALTH_H_
