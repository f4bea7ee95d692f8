// Readers of a map's history, one for each who reads at the same time.
#ifndef HYPERMAP_SERVER_SESSION_HISTORY_POOL_H_
#define HYPERMAP_SERVER_SESSION_HISTORY_POOL_H_

#include <memory>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "base/sync/mutex.h"
#include "storage/map_store.h"

namespace hypermap::server {

// Opens readers when there is none to spare, and keeps some of those that come back, whose caches
// are warm. Thread safe.
class HistoryPool {
  struct State;

 public:
  // A reader that is its holder's until it dies; may outlive the pool.
  class Lease {
   public:
    Lease(Lease&&) = default;
    Lease& operator=(Lease&& other) noexcept {
      std::swap(state_, other.state_);
      std::swap(reader_, other.reader_);
      return *this;
    }
    ~Lease();

    storage::HistoryReader& operator*() const { return *reader_; }
    storage::HistoryReader* operator->() const { return reader_.get(); }

   private:
    friend class HistoryPool;
    Lease(std::shared_ptr<State> state, std::unique_ptr<storage::HistoryReader> reader)
        : state_(std::move(state)), reader_(std::move(reader)) {}

    std::shared_ptr<State> state_;
    std::unique_ptr<storage::HistoryReader> reader_;
  };

  // `stored` outlives this, or is closed after Close.
  explicit HistoryPool(storage::StoredMap* stored);

  // UNAVAILABLE after Close; errors as StoredMap::OpenHistory.
  absl::StatusOr<Lease> Take();

  // Opens none any more.
  void Close();

 private:
  const std::shared_ptr<State> state_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_HISTORY_POOL_H_
