// Bounds the bytes of memory or disk, or the calls, that all requests hold together.
#ifndef HYPERMAP_BASE_ADMISSION_BUDGET_H_
#define HYPERMAP_BASE_ADMISSION_BUDGET_H_

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "base/sync/mutex.h"

namespace hypermap::admission {

struct BudgetOptions {
  // The name of what is counted, for messages.
  std::string unit = "bytes";
  // True if one client may hold the whole budget. If not, it may hold half.
  bool whole_for_one_client = false;
  // True if a charge that exceeds the budget, or a client's half of it, is accepted while nobody,
  // or that client, holds anything.
  bool takes_one_larger = false;
};

// An amount that is shared by all clients. Thread safe.
class Budget {
 public:
  // The amount that one request holds. It is given back when this is destroyed, which must be
  // before the budget is.
  class Charge {
   public:
    // `client` shares its part of the budget with all charges of the same name.
    Charge(Budget* budget, absl::string_view client) : budget_(budget), client_(client) {}
    ~Charge() { GiveBack(); }
    Charge(const Charge&) = delete;
    Charge& operator=(const Charge&) = delete;

    // Takes more. Call it before the memory is allocated or the file is written. On error nothing
    // is taken: TryLater, naming the flag, if others hold too much now; a RESOURCE_EXHAUSTED that
    // is not to be retried if one client may never hold the amount.
    absl::Status Add(int64_t amount);
    void GiveBack() { GiveBack(amount_); }
    // REQUIRES: amount <= amount().
    void GiveBack(int64_t amount) {
      amount_ -= amount;
      budget_->GiveBack(client_, amount);
    }
    int64_t amount() const { return amount_; }

   private:
    Budget* const budget_;
    const std::string client_;
    int64_t amount_ = 0;
  };

  // `flag` is the name by which a refusal calls the budget. An `amount` of 0 bounds nothing.
  Budget(absl::string_view flag, int64_t amount, BudgetOptions options = {});
  Budget(const Budget&) = delete;
  Budget& operator=(const Budget&) = delete;

  int64_t used() const;

 private:
  static constexpr size_t kForgetAt = 1'000;

  absl::Status Take(const std::string& client, int64_t amount);
  void GiveBack(const std::string& client, int64_t amount);
  absl::Status RefuseForGood(int64_t amount) const;
  absl::Status RefuseClient() const;
  absl::Status Refuse() const;

  const std::string flag_;
  const int64_t amount_;
  const BudgetOptions options_;
  const int64_t of_one_client_;
  mutable Mutex mutex_;
  int64_t used_ ABSL_GUARDED_BY(mutex_) = 0;
  // Clients that hold nothing stay, because most come again soon.
  absl::flat_hash_map<std::string, int64_t> used_by_ ABSL_GUARDED_BY(mutex_);
  // Number of clients at which those that hold nothing are forgotten.
  size_t forget_at_ ABSL_GUARDED_BY(mutex_) = kForgetAt;
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_BUDGET_H_
