#include "client_libs/cpp/outbox/outbox_desk.h"

namespace hypermap::client {

absl::StatusOr<std::vector<storage::Letter>> OutboxDesk::AwaitFirst(int64_t stream, int limit) {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!closed_) {
    absl::StatusOr<std::vector<storage::Letter>> letters = file_->First(stream, limit);
    if (!letters.ok() || !letters->empty()) return letters;
    changed_.wait(lock);
  }
  return std::vector<storage::Letter>();
}

absl::StatusOr<bool> OutboxDesk::AwaitEmpty(absl::Time deadline) {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    const absl::StatusOr<storage::OutboxCounts> counts = file_->Counts();
    if (!counts.ok()) return counts.status();
    if (counts->queued == 0) return true;
    if (changed_.wait_until(lock, absl::ToChronoTime(deadline)) == std::cv_status::timeout) {
      return false;
    }
  }
}

void OutboxDesk::NoteProblem(int64_t stream, absl::Status problem) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (problem.ok()) {
    problems_.erase(stream);
  } else {
    problems_[stream] = std::move(problem);
  }
}

absl::Status OutboxDesk::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problems_.empty() ? absl::OkStatus() : problems_.begin()->second;
}

bool OutboxDesk::Sleep(absl::Duration duration) {
  std::unique_lock<std::mutex> lock(mutex_);
  return !changed_.wait_for(lock, absl::ToChronoNanoseconds(duration), [this] { return closed_; });
}

void OutboxDesk::Close() {
  const std::lock_guard<std::mutex> lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

}  // namespace hypermap::client
