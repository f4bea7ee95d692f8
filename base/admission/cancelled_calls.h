// Finds the connections that cancel so many calls that they flood the server.
#ifndef HYPERMAP_BASE_ADMISSION_CANCELLED_CALLS_H_
#define HYPERMAP_BASE_ADMISSION_CANCELLED_CALLS_H_

#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"

namespace hypermap::admission {

// Counts the calls that were cancelled soon after they began (HTTP/2 Rapid Reset, CVE-2023-44487),
// for each connection. Unlike a look at the bytes of a connection, it also works with TLS, but it
// sees a call only when the server has begun to handle it. Thread safe.
class CancelledCalls {
 public:
  // A call that is cancelled when it is older has done what it was for, such as a watch.
  static constexpr absl::Duration kSoon = absl::Seconds(1);
  // Calls of one connection that may be cancelled soon in one period.
  static constexpr int kMaxInPeriod = 1'000;
  static constexpr absl::Duration kPeriod = absl::Seconds(1);

  // Counts a call of `peer`, an address as gRPC writes it, that was cancelled `age` after its
  // begin.
  void Count(absl::string_view peer, absl::Duration age);

  // The peers (NormalizedPeer) with more than kMaxInPeriod calls in this period, each once.
  std::vector<std::string> TakeFloods();

 private:
  Mutex mutex_;
  SteadyTime period_began_ ABSL_GUARDED_BY(mutex_) = SteadyTime::InfinitePast();
  absl::flat_hash_map<std::string, int> num_of_peer_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> floods_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_CANCELLED_CALLS_H_
