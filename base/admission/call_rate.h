// How many calls each client may begin in a second.
#ifndef HYPERMAP_BASE_ADMISSION_CALL_RATE_H_
#define HYPERMAP_BASE_ADMISSION_CALL_RATE_H_

#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "base/admission/pace.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"

namespace hypermap::admission {

// Bounds the calls of each client: it may begin those of a second at once, and then as many in each
// second. Thread safe.
class CallRate {
 public:
  // `per_second` calls; 0 bounds nothing.
  explicit CallRate(double per_second) : per_second_(per_second), pace_(per_second, per_second) {}

  // OK, or TryLater naming --max_calls_per_second.
  absl::Status Take(const std::string& client, SteadyTime now = SteadyTime::Now());

 private:
  const double per_second_;
  Mutex mutex_;
  Pace pace_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_CALL_RATE_H_
