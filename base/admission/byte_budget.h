// Bytes of memory or disk that requests may hold together.
#ifndef HYPERMAP_BASE_ADMISSION_BYTE_BUDGET_H_
#define HYPERMAP_BASE_ADMISSION_BYTE_BUDGET_H_

#include <cstdint>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "base/sync/mutex.h"

namespace hypermap::admission {

// A number of bytes that is shared by all clients, of which one client may hold at most half.
// Thread safe.
class ByteBudget {
 public:
  // The bytes that one request holds. They are given back when it is destroyed, which must be
  // before the budget is.
  class Charge {
   public:
    // `client` shares its part of the budget with all charges of the same name.
    Charge(ByteBudget* budget, absl::string_view client) : budget_(budget), client_(client) {}
    ~Charge() { budget_->GiveBack(client_, bytes_); }
    Charge(const Charge&) = delete;
    Charge& operator=(const Charge&) = delete;

    // Takes more bytes, to be called before they are used. RESOURCE_EXHAUSTED, naming the flag, if
    // they are not to be had; then nothing is taken.
    absl::Status Add(int64_t bytes);
    int64_t bytes() const { return bytes_; }

   private:
    ByteBudget* const budget_;
    const std::string client_;
    int64_t bytes_ = 0;
  };

  // `flag` is the name by which a refusal calls the budget.
  ByteBudget(absl::string_view flag, int64_t bytes) : flag_(flag), bytes_(bytes) {}
  ByteBudget(const ByteBudget&) = delete;
  ByteBudget& operator=(const ByteBudget&) = delete;

  int64_t used_bytes() const;

 private:
  absl::Status Take(const std::string& client, int64_t bytes);
  void GiveBack(const std::string& client, int64_t bytes);

  const std::string flag_;
  const int64_t bytes_;
  mutable Mutex mutex_;
  int64_t used_ ABSL_GUARDED_BY(mutex_) = 0;
  absl::flat_hash_map<std::string, int64_t> used_by_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_BYTE_BUDGET_H_
