// What can be done with an open map, by what its store has answered.
#ifndef HYPERMAP_SERVER_SESSION_MAP_HEALTH_H_
#define HYPERMAP_SERVER_SESSION_MAP_HEALTH_H_

#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "map/entries.h"

namespace hypermap::server {

struct MapCondition {
  MapState state = MapState::kServing;
  absl::Status problem;  // why the state is not kServing
};

// A map is read-only after a failed attempt to write, until one succeeds. A trial write is due
// after kFirstTrial, and after each that fails as well in twice the time, at most kLastTrial: so a
// map to which nobody writes notices that its disk has room again. What is damaged stays so. Logs
// when writing begins to fail, when it succeeds again, and each damage. Thread safe.
class MapHealth {
 public:
  static constexpr absl::Duration kFirstTrial = absl::Seconds(1);
  static constexpr absl::Duration kLastTrial = absl::Seconds(10);

  explicit MapHealth(std::string map) : map_(std::move(map)) {}

  // Notes the result of a write, `now` by any clock that never goes back. DATA_LOSS is damage,
  // which other changes may not meet. An error that is the caller's, because it gave up, says
  // nothing.
  void NoteWrite(const absl::Status& written, absl::Duration now);
  // Adds to the damage that was found before, if it is not among it. OK: there is none.
  void NoteDamage(const absl::Status& damage);

  // kServing, kDamaged or kReadOnly.
  MapCondition condition() const;
  // The time of the next trial; infinite if none is due.
  absl::Duration next_trial() const;

 private:
  const std::string map_;
  mutable Mutex mutex_;
  absl::Status unwritten_ ABSL_GUARDED_BY(mutex_);  // of the newest write
  absl::Duration pause_ ABSL_GUARDED_BY(mutex_) = kFirstTrial;
  absl::Duration next_trial_ ABSL_GUARDED_BY(mutex_) = absl::InfiniteDuration();
  absl::Status damage_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_MAP_HEALTH_H_
