// Moments by a clock that nobody sets.
#ifndef HYPERMAP_BASE_SYNC_STEADY_TIME_H_
#define HYPERMAP_BASE_SYNC_STEADY_TIME_H_

#include <chrono>
#include <compare>

#include "absl/time/time.h"

namespace hypermap {

// A moment of the machine's monotonic clock. It goes on evenly when the wall clock is set or stands
// still, and therefore measures all that a process waits for, paces or limits. It tells no date,
// and means nothing to another process.
class SteadyTime {
 public:
  static SteadyTime Now() {
    return SteadyTime(absl::FromChrono(std::chrono::steady_clock::now().time_since_epoch()));
  }
  static constexpr SteadyTime InfinitePast() { return SteadyTime(-absl::InfiniteDuration()); }
  static constexpr SteadyTime InfiniteFuture() { return SteadyTime(absl::InfiniteDuration()); }

  friend SteadyTime operator+(SteadyTime time, absl::Duration duration) {
    return SteadyTime(time.since_epoch_ + duration);
  }
  friend SteadyTime operator-(SteadyTime time, absl::Duration duration) {
    return SteadyTime(time.since_epoch_ - duration);
  }
  friend absl::Duration operator-(SteadyTime a, SteadyTime b) {
    return a.since_epoch_ - b.since_epoch_;
  }
  friend bool operator==(SteadyTime a, SteadyTime b) { return a.since_epoch_ == b.since_epoch_; }
  friend std::strong_ordering operator<=>(SteadyTime a, SteadyTime b) {
    if (a.since_epoch_ < b.since_epoch_) return std::strong_ordering::less;
    if (b.since_epoch_ < a.since_epoch_) return std::strong_ordering::greater;
    return std::strong_ordering::equal;
  }

 private:
  explicit constexpr SteadyTime(absl::Duration since_epoch) : since_epoch_(since_epoch) {}

  absl::Duration since_epoch_;  // of the clock, which is no date
};

}  // namespace hypermap

#endif  // HYPERMAP_BASE_SYNC_STEADY_TIME_H_
