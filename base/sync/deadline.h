// Deadlines of waits.
#ifndef HYPERMAP_BASE_SYNC_DEADLINE_H_
#define HYPERMAP_BASE_SYNC_DEADLINE_H_

#include <chrono>

#include "absl/time/time.h"

namespace hypermap {

// The end of a time that begins when this is made. It is measured by a clock that nobody sets, so
// that a wait ends in time when the wall clock is set back.
class Deadline {
 public:
  explicit Deadline(absl::Duration after) : after_(after) {}

  // The time that is left; zero or negative once the deadline has passed.
  absl::Duration left() const {
    return after_ - absl::FromChrono(std::chrono::steady_clock::now() - begin_);
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  absl::Duration after_;
};

}  // namespace hypermap

#endif  // HYPERMAP_BASE_SYNC_DEADLINE_H_
