#include "server/session/history_pool.h"

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::server {
namespace {

// Number of idle readers that are kept: each holds an open file and its cache.
constexpr size_t kMaxSpare = 8;

}  // namespace

struct HistoryPool::State {
  Mutex mutex;
  storage::StoredMap* stored ABSL_GUARDED_BY(mutex) = nullptr;  // null after Close
  std::vector<std::unique_ptr<storage::HistoryReader>> spare ABSL_GUARDED_BY(mutex);
};

HistoryPool::HistoryPool(storage::StoredMap* stored) : state_(std::make_shared<State>()) {
  MutexLock lock(&state_->mutex);
  state_->stored = stored;
}

HistoryPool::Lease::~Lease() {
  if (!reader_) return;
  MutexLock lock(&state_->mutex);
  if (state_->stored == nullptr || state_->spare.size() >= kMaxSpare) return;
  state_->spare.push_back(std::move(reader_));
}

absl::StatusOr<HistoryPool::Lease> HistoryPool::Take() {
  MutexLock lock(&state_->mutex);
  if (state_->stored == nullptr) return absl::UnavailableError("the map is closing");
  if (!state_->spare.empty()) {
    std::unique_ptr<storage::HistoryReader> reader = std::move(state_->spare.back());
    state_->spare.pop_back();
    return Lease(state_, std::move(reader));
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::HistoryReader> reader,
                            state_->stored->OpenHistory());
  return Lease(state_, std::move(reader));
}

void HistoryPool::Close() {
  // Destroyed after the lock is released, because closing a reader takes time.
  std::vector<std::unique_ptr<storage::HistoryReader>> closed;
  MutexLock lock(&state_->mutex);
  state_->stored = nullptr;
  closed.swap(state_->spare);
}

}  // namespace hypermap::server
