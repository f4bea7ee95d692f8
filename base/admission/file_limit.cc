#include "base/admission/file_limit.h"

#include <sys/resource.h>

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace hypermap::admission {
namespace {

// More files than this are never needed. The hard limit may be unlimited.
constexpr rlim_t kMaxFiles = rlim_t{1} << 20;
constexpr int64_t kMaxConnections = 10'000;
constexpr int64_t kFewestConnections = 16;

}  // namespace

int64_t RaiseFileLimit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return static_cast<int64_t>(kMaxFiles);
  rlimit raised = limit;
  raised.rlim_cur = std::max(limit.rlim_cur, std::min(limit.rlim_max, kMaxFiles));
  if (setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
  return static_cast<int64_t>(std::min(limit.rlim_cur, kMaxFiles));
}

absl::StatusOr<ConnectionLimits> LimitConnections(const ConnectionLimits& asked, int64_t file_limit,
                                                  int64_t reserved) {
  const int64_t possible = std::min((file_limit - reserved) / 4 * 3, kMaxConnections);
  if (possible < kFewestConnections) {
    return absl::FailedPreconditionError(
        absl::StrCat("the limit of open files (ulimit -n) is ", file_limit, ", but ", reserved,
                     " are needed besides connections; raise it to at least ",
                     reserved + 2 * kFewestConnections));
  }
  ConnectionLimits limits = asked;
  if (limits.max_connections == 0) limits.max_connections = static_cast<int>(possible);
  if (limits.max_connections > possible) {
    return absl::InvalidArgumentError(
        absl::StrCat("--max_connections=", asked.max_connections, " is more than the ", possible,
                     " for which the limit of open files (ulimit -n) leaves room"));
  }
  if (limits.max_connections_per_address == 0) {
    limits.max_connections_per_address = limits.max_connections / 4 * 3;
  }
  return limits;
}

}  // namespace hypermap::admission
