#include "base/admission/cancelled_calls.h"

#include <utility>

#include "absl/time/clock.h"
#include "base/admission/client_host.h"

namespace hypermap::admission {

void CancelledCalls::Count(absl::string_view peer, absl::Duration age) {
  if (age > kSoon) return;
  const absl::Time now = absl::Now();
  const MutexLock lock(&mutex_);
  // A clock that was set back begins a new period, too.
  if (now < period_began_ || now > period_began_ + kPeriod) {
    period_began_ = now;
    num_of_peer_.clear();
  }
  if (++num_of_peer_[peer] == kMostInPeriod + 1) floods_.push_back(NormalizedPeer(peer));
}

std::vector<std::string> CancelledCalls::TakeFloods() {
  const MutexLock lock(&mutex_);
  return std::exchange(floods_, {});
}

}  // namespace hypermap::admission
