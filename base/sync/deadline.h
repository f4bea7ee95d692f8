// Deadlines of waits.
#ifndef HYPERMAP_BASE_SYNC_DEADLINE_H_
#define HYPERMAP_BASE_SYNC_DEADLINE_H_

#include "absl/time/time.h"
#include "base/sync/steady_time.h"

namespace hypermap {

// The end of a time that begins when this is made. Never comes if the time is infinite.
class Deadline {
 public:
  explicit Deadline(absl::Duration after) : end_(SteadyTime::Now() + after) {}

  // The time that is left; zero or negative once the deadline has passed.
  absl::Duration left() const { return end_ - SteadyTime::Now(); }
  bool has_passed() const { return left() <= absl::ZeroDuration(); }

 private:
  SteadyTime end_;
};

}  // namespace hypermap

#endif  // HYPERMAP_BASE_SYNC_DEADLINE_H_
