#include "server/rpc/log_pace.h"

#include <utility>

namespace hypermap::server {

std::optional<int64_t> LogPace::Take(const std::string& host, SteadyTime now) {
  const MutexLock lock(&mutex_);
  if (pace_.Take(host, now)) return std::exchange(left_out_, 0);
  ++left_out_;
  return std::nullopt;
}

}  // namespace hypermap::server
