#include "server/session/session_meters.h"

#include <algorithm>

namespace hypermap::server {

void SessionMeters::AddGroup(int64_t commits, int64_t changes) {
  if (commits == 0) return;
  const auto bound = std::lower_bound(kBounds.begin(), kBounds.end(), commits);
  groups_[static_cast<size_t>(bound - kBounds.begin())].fetch_add(1, std::memory_order_relaxed);
  commits_.fetch_add(commits, std::memory_order_relaxed);
  changes_.fetch_add(changes, std::memory_order_relaxed);
}

void SessionMeters::AddWatchLag(int64_t revisions) {
  const auto bound = std::lower_bound(kLagBounds.begin(), kLagBounds.end(), revisions);
  lags_[static_cast<size_t>(bound - kLagBounds.begin())].fetch_add(1, std::memory_order_relaxed);
  total_lag_.fetch_add(revisions, std::memory_order_relaxed);
}

void SessionMeters::SetFoldWork(const FoldWork& work) {
  folded_.store(work.folded, std::memory_order_relaxed);
  repeated_.store(work.repeated, std::memory_order_relaxed);
  fold_cpu_ns_.store(absl::ToInt64Nanoseconds(work.cpu), std::memory_order_relaxed);
}

SessionMeters::Reading SessionMeters::Read() const {
  Reading reading;
  reading.commits = commits_.load(std::memory_order_relaxed);
  reading.changes = changes_.load(std::memory_order_relaxed);
  reading.failed_groups = failed_groups_.load(std::memory_order_relaxed);
  for (size_t i = 0; i < groups_.size(); ++i) {
    reading.groups[i] = groups_[i].load(std::memory_order_relaxed);
  }
  for (size_t i = 0; i < kOutcomes; ++i) {
    reading.observations[i] = observations_[i].load(std::memory_order_relaxed);
  }
  for (size_t i = 0; i < lags_.size(); ++i) {
    reading.lags[i] = lags_[i].load(std::memory_order_relaxed);
  }
  reading.total_lag = total_lag_.load(std::memory_order_relaxed);
  reading.fold_work.folded = folded_.load(std::memory_order_relaxed);
  reading.fold_work.repeated = repeated_.load(std::memory_order_relaxed);
  reading.fold_work.cpu = absl::Nanoseconds(fold_cpu_ns_.load(std::memory_order_relaxed));
  return reading;
}

}  // namespace hypermap::server
