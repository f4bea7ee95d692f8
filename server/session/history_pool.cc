#include "server/session/history_pool.h"

#include <atomic>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "base/admission/refusals.h"
#include "base/status/status_macros.h"

namespace hypermap::server {
namespace {

// Number of idle readers that are kept: each holds open files and memory.
constexpr size_t kMaxSpare = 8;

// Readers that may yet be opened in this process beyond one for each pool.
std::atomic<int64_t> extra_readers = int64_t{1} << 40;

bool TakeExtraReader() {
  if (extra_readers.fetch_sub(1) > 0) return true;
  extra_readers.fetch_add(1);
  return false;
}

}  // namespace

struct HistoryPool::State {
  ~State() { extra_readers.fetch_add(num_allowed - 1); }

  // Allows one more reader to be open. RESOURCE_EXHAUSTED as HistoryPool::Take.
  absl::Status Allow() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex);

  Mutex mutex;
  storage::StoredMap* stored ABSL_GUARDED_BY(mutex) = nullptr;  // null after Close
  std::vector<std::unique_ptr<storage::HistoryReader>> spare ABSL_GUARDED_BY(mutex);
  int num_open ABSL_GUARDED_BY(mutex) = 0;  // lent or spare
  // The largest value of num_open, without a reader of TakeReserved. It does not decrease when
  // readers are closed: SQLite keeps the file of a closed connection open until the map is closed,
  // because closing it would release the locks of the other connections
  // (https://www.sqlite.org/howtocorrupt.html, section 2.2).
  int num_allowed ABSL_GUARDED_BY(mutex) = 1;
};

absl::Status HistoryPool::State::Allow() {
  if (num_open < num_allowed) return absl::OkStatus();
  if (!TakeExtraReader()) {
    return admission::TryLater(
        absl::StrCat("past revisions of the map are read by ", num_open,
                     " at once, and the limits of open files (ulimit -n) and of memory "
                     "(--memory_limit) allow no more"));
  }
  ++num_allowed;
  return absl::OkStatus();
}

void HistoryPool::LimitExtraReaders(int max_readers) { extra_readers = max_readers; }

HistoryPool::HistoryPool(storage::StoredMap* stored) : state_(std::make_shared<State>()) {
  MutexLock lock(&state_->mutex);
  state_->stored = stored;
}

HistoryPool::Lease::~Lease() {
  if (!reader_) return;
  MutexLock lock(&state_->mutex);
  const bool exceeds_limit = state_->num_open > state_->num_allowed;
  if (state_->stored == nullptr || exceeds_limit || state_->spare.size() >= kMaxSpare) {
    --state_->num_open;
    return;
  }
  state_->spare.push_back(std::move(reader_));
}

absl::StatusOr<HistoryPool::Lease> HistoryPool::Take() { return Lend(/*is_reserved=*/false); }

absl::StatusOr<HistoryPool::Lease> HistoryPool::TakeReserved() {
  return Lend(/*is_reserved=*/true);
}

absl::StatusOr<HistoryPool::Lease> HistoryPool::Lend(bool is_reserved) {
  MutexLock lock(&state_->mutex);
  if (state_->stored == nullptr) return absl::UnavailableError("the map is closing");
  if (!state_->spare.empty()) {
    std::unique_ptr<storage::HistoryReader> reader = std::move(state_->spare.back());
    state_->spare.pop_back();
    return Lease(state_, std::move(reader));
  }
  if (!is_reserved) {
    HYPERMAP_RETURN_IF_ERROR(state_->Allow());
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::HistoryReader> reader,
                            state_->stored->OpenHistory());
  ++state_->num_open;
  return Lease(state_, std::move(reader));
}

void HistoryPool::Close() {
  // Destroyed after the lock is released, because closing a reader takes time.
  std::vector<std::unique_ptr<storage::HistoryReader>> closed;
  MutexLock lock(&state_->mutex);
  state_->stored = nullptr;
  closed.swap(state_->spare);
  state_->num_open -= static_cast<int>(closed.size());
}

}  // namespace hypermap::server
