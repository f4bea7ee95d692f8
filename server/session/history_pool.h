// A pool of readers of a map's history, one for each concurrent query.
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

// Lends readers. It opens one when none is idle, and keeps some of the returned ones, because
// opening a reader costs a database connection and a returned one has warm caches. Thread safe.
//
// A reader holds memory and open files, of which the process may have a limited number. Each pool
// may therefore have one reader open at any time, and all pools of the process share those beyond
// one. What clients hold never keeps the map itself from reading its history: TakeReserved.
class HistoryPool {
  struct State;

 public:
  // Exclusive use of a reader, which the destructor returns to the pool. May outlive the pool.
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

  // Limits the readers that all pools together may have open beyond one for each. Unlimited until
  // the first call, which must come before any pool opens a reader.
  static void LimitExtraReaders(int max_readers);

  // `stored` must stay open until Close or the end of this.
  explicit HistoryPool(storage::StoredMap* stored);

  // UNAVAILABLE after Close; RESOURCE_EXHAUSTED (TryLater) if no reader is idle and no more may be
  // opened; errors as StoredMap::OpenHistory.
  absl::StatusOr<Lease> Take();

  // The same for the map's own maintenance, which needs a reader whatever clients hold: if no
  // reader is idle and no more may be opened, it opens one beyond the limit, which is closed when
  // it is returned. REQUIRES: there is no other such lease of this pool, and it ends soon.
  absl::StatusOr<Lease> TakeReserved();

  // Destroys the idle readers and opens no more. Readers on loan stay usable.
  void Close();

 private:
  absl::StatusOr<Lease> Lend(bool is_reserved);

  const std::shared_ptr<State> state_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_HISTORY_POOL_H_
