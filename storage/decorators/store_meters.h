// Measures what is asked of a store.
#ifndef HYPERMAP_STORAGE_DECORATORS_STORE_METERS_H_
#define HYPERMAP_STORAGE_DECORATORS_STORE_METERS_H_

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace hypermap::storage {

// What a server waits for.
enum class StoreOperation {
  kOpen,             // MapStore::Open and Follow
  kLoad,             // StoredMap::Load
  kWrite,            // StoredMap::Write
  kFindReceipts,     // StoredMap::FindReceipt and FindReceipts
  kCompact,          // StoredMap::Compact, a step
  kSurvey,           // MapStore::TakeSurvey
  kNewestRevisions,  // MapStore::NewestRevisions
};
inline constexpr size_t kNumStoreOperations = 7;
// Such as "write".
const char* NameOf(StoreOperation operation);

// Times and failures of operations. Thread safe, without locks.
class StoreMeters {
 public:
  // Upper bounds of the classes of times, seconds; the last class has no bound.
  static constexpr std::array<double, 10> kBounds = {0.0001, 0.0003, 0.001, 0.003, 0.01,
                                                     0.03,   0.1,    0.3,   1,     10};

  void Add(StoreOperation operation, absl::Duration time, const absl::Status& status);

  struct Reading {
    std::array<int64_t, kBounds.size() + 1> times = {};  // in each class, also of failures
    absl::Duration total;
    // With UNAVAILABLE, RESOURCE_EXHAUSTED, DATA_LOSS and the like: other errors are answers.
    int64_t failures = 0;
  };
  Reading Read(StoreOperation operation) const;

 private:
  struct OfOperation {
    std::array<std::atomic<int64_t>, kBounds.size() + 1> times = {};
    std::atomic<int64_t> total_ns = 0;
    std::atomic<int64_t> failures = 0;
  };

  std::array<OfOperation, kNumStoreOperations> operations_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_DECORATORS_STORE_METERS_H_
