// Bounds how much of the log the calls of one host can fill.
#ifndef HYPERMAP_SERVER_RPC_LOG_PACE_H_
#define HYPERMAP_SERVER_RPC_LOG_PACE_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "base/admission/pace.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"

namespace hypermap::server {

// Decides which lines are written, and counts the others. Thread safe.
class LogPace {
 public:
  // Lines of one host at once, and each second from then on.
  static constexpr double kBurst = 1000.0;
  static constexpr double kPerSecond = 10.0;

  // Returns nullopt if a line about a call of this host must be left out; otherwise the number of
  // lines, of all hosts, that were left out since the last one that was not.
  std::optional<int64_t> Take(const std::string& host, SteadyTime now = SteadyTime::Now());

 private:
  Mutex mutex_;
  admission::Pace pace_ ABSL_GUARDED_BY(mutex_){kPerSecond, kBurst};
  int64_t left_out_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_LOG_PACE_H_
