// Refusals of what exceeds a limit: which ones pass by themselves, and how many there were.
#ifndef HYPERMAP_BASE_ADMISSION_REFUSALS_H_
#define HYPERMAP_BASE_ADMISSION_REFUSALS_H_

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"

namespace hypermap::admission {

// Returns RESOURCE_EXHAUSTED for a request that may succeed unchanged a little later, because
// others fill a limit now. `message` names the limit's flag.
absl::Status TryLater(absl::string_view message);
// Returns whether the status is one of TryLater.
bool IsTryLater(const absl::Status& status);

// Counts refusals by the flag that they name. Thread safe.
class Refusals {
 public:
  struct Line {
    std::string flag;     // with its dashes; "a limit" if the refusal names none
    int64_t count;        // of refusals by this flag since the start
    std::string message;  // of the last one; may have text that a client chose
  };

  // `log` takes at most one line for each flag in 10 s.
  explicit Refusals(std::function<void(const Line&)> log) : log_(std::move(log)) {}

  // Counts the status if it is RESOURCE_EXHAUSTED.
  void Count(const absl::Status& status);

  int64_t NumOf(const std::string& flag) const;
  // The numbers by flag; of flags without refusals there are none.
  std::map<std::string, int64_t> Numbers() const;
  // Returns whether there was a refusal of TryLater within this time: the server has more to do
  // than it may take on.
  bool IsOverloaded(absl::Duration within) const;

 private:
  struct Entry {
    int64_t count = 0;
    SteadyTime logged = SteadyTime::InfinitePast();
  };

  const std::function<void(const Line&)> log_;
  mutable Mutex mutex_;
  std::map<std::string, Entry> entries_ ABSL_GUARDED_BY(mutex_);  // by flag
  SteadyTime overloaded_ ABSL_GUARDED_BY(mutex_) = SteadyTime::InfinitePast();
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_REFUSALS_H_
