#include "base/admission/cancelled_calls.h"

#include <utility>

#include "base/admission/client_host.h"
#include "base/sync/steady_time.h"

namespace hypermap::admission {

void CancelledCalls::Count(absl::string_view peer, absl::Duration age) {
  if (age > kSoon) return;
  const SteadyTime now = SteadyTime::Now();
  const MutexLock lock(&mutex_);
  if (now > period_began_ + kPeriod) {
    period_began_ = now;
    num_of_peer_.clear();
  }
  if (++num_of_peer_[peer] == kMaxInPeriod + 1) floods_.push_back(NormalizedPeer(peer));
}

std::vector<std::string> CancelledCalls::TakeFloods() {
  const MutexLock lock(&mutex_);
  return std::exchange(floods_, {});
}

}  // namespace hypermap::admission
