#include "client_libs/cpp/outbox/outbox_queue.h"

#include <algorithm>

#include "absl/time/time.h"
#include "base/status/status_macros.h"

namespace hypermap::client {
absl::StatusOr<std::vector<storage::QueuedRequest>> OutboxQueue::AwaitFirst(int64_t stream,
                                                                            int limit) {
  const MutexLock lock(&mutex_);
  while (!closed_) {
    absl::StatusOr<std::vector<storage::QueuedRequest>> requests = file_->First(stream, limit);
    if (!requests.ok() || !requests->empty()) return requests;
    changed_.Wait(&mutex_);
  }
  return std::vector<storage::QueuedRequest>();
}

absl::StatusOr<bool> OutboxQueue::AwaitEmpty(const Deadline& deadline) {
  const MutexLock lock(&mutex_);
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const storage::OutboxCounts counts, file_->Counts());
    if (counts.queued == 0) return true;
    const absl::Duration left = deadline.left();
    if (left <= absl::ZeroDuration()) return false;
    changed_.WaitFor(&mutex_, left);
  }
}

void OutboxQueue::NoteProblem(int64_t stream, absl::Status problem) {
  const MutexLock lock(&mutex_);
  if (problem.ok()) {
    problems_.erase(stream);
  } else {
    problems_[stream] = std::move(problem);
  }
}

absl::Status OutboxQueue::problem() const {
  const MutexLock lock(&mutex_);
  return problems_.empty() ? absl::OkStatus() : problems_.begin()->second;
}

bool OutboxQueue::Sleep(absl::Duration duration) {
  const MutexLock lock(&mutex_);
  const Deadline deadline(duration);
  while (!closed_) {
    const absl::Duration left = deadline.left();
    if (left <= absl::ZeroDuration()) return true;
    changed_.WaitFor(&mutex_, left);
  }
  return false;
}

void OutboxQueue::Close() {
  const MutexLock lock(&mutex_);
  closed_ = true;
  changed_.NotifyAll();
}

}  // namespace hypermap::client
