#include "client_libs/ros2/bridge/problem_log.h"

#include "absl/time/time.h"
#include "base/logging/log.h"

namespace hypermap::ros2 {
namespace {

constexpr absl::Duration kBetweenLines = absl::Seconds(10);

}  // namespace

void ProblemLog::Note(absl::string_view kind, const absl::Status& problem, int64_t count) {
  const MutexLock lock(&mutex_);
  Kind& noted = kinds_[std::string(kind)];
  noted.count += count;
  if (SteadyTime::Now() - noted.logged < kBetweenLines) return;
  noted.logged = SteadyTime::Now();
  logging::Log(logging::Level::kWarning, kind,
               {{"count", noted.count}, {"problem", problem.message()}});
}

int64_t ProblemLog::CountOf(absl::string_view kind) const {
  const MutexLock lock(&mutex_);
  const auto it = kinds_.find(kind);
  return it == kinds_.end() ? 0 : it->second.count;
}

}  // namespace hypermap::ros2
