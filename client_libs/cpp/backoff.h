// Exponential backoff between retries.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_BACKOFF_H_
#define HYPERMAP_CLIENT_LIBS_CPP_BACKOFF_H_

#include <algorithm>

#include "absl/random/random.h"
#include "absl/time/time.h"

namespace hypermap::client {

// Waits double from 50 ms up to 2 s. Each is drawn at random from the upper half of its range, so
// that many clients do not come back at once. Used by one thread.
class Backoff {
 public:
  // Returns the next wait.
  absl::Duration Next() {
    const absl::Duration longest = wait_;
    wait_ = std::min(2 * wait_, kLongest);
    return longest * absl::Uniform(random_, 0.5, 1.0);
  }
  // Call after a success: the next wait is the shortest again.
  void Reset() { wait_ = kShortest; }

 private:
  static constexpr absl::Duration kShortest = absl::Milliseconds(50);
  static constexpr absl::Duration kLongest = absl::Seconds(2);

  absl::Duration wait_ = kShortest;
  absl::BitGen random_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_BACKOFF_H_
