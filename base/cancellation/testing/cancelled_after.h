// Cancellations that tests time by counting.
#ifndef HYPERMAP_BASE_CANCELLATION_TESTING_CANCELLED_AFTER_H_
#define HYPERMAP_BASE_CANCELLATION_TESTING_CANCELLED_AFTER_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "base/cancellation/cancellation.h"

namespace hypermap {

// Cancels the work of this thread, while this lives, when it has been looked at `num_looks` times.
// Every call of IsCancelled and CheckCancelled looks.
class CancelledAfter {
 public:
  explicit CancelledAfter(int64_t num_looks)
      : left_(num_looks),
        cancellation_(
            [this] {
              ++num_looks_;
              return left_-- > 0 ? absl::OkStatus() : absl::CancelledError("the test cancels");
            },
            absl::ZeroDuration()),
        here_(&cancellation_) {}

  Cancellation& cancellation() { return cancellation_; }
  // The number of times that the work was looked at so far.
  int64_t num_looks() const { return num_looks_; }

 private:
  int64_t left_;
  int64_t num_looks_ = 0;
  Cancellation cancellation_;
  ScopedCancellation here_;
};

// Runs `work`, which returns a status, again and again: cancelled at its first look, then at later
// and later ones, until it runs to its end. Returns the number of runs that were cancelled, or -1
// if one of them did not return the error of the cancellation.
template <typename Work>
int TimesCancelled(Work work) {
  int times = 0;
  for (int64_t looks = 0;; looks += 1 + looks / 4) {
    CancelledAfter cancelled(looks);
    const absl::Status status = work();
    if (cancelled.cancellation().status().ok()) return times;
    if (!absl::IsCancelled(status)) return -1;
    ++times;
  }
}

}  // namespace hypermap

#endif  // HYPERMAP_BASE_CANCELLATION_TESTING_CANCELLED_AFTER_H_
