#include "base/cancellation/cancellation.h"

#include <chrono>
#include <ctime>
#include <limits>
#include <optional>
#include <utility>

#include "base/cancellation/give_way.h"

namespace hypermap {
namespace {

thread_local Cancellation* current = nullptr;

int64_t SteadyNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

Cancellation::Cancellation(Look look, absl::Duration interval, FirstLook first)
    : look_(std::move(look)),
      interval_ns_(absl::ToInt64Nanoseconds(interval)),
      next_look_ns_(first == FirstLook::kAtOnce ? std::numeric_limits<int64_t>::min()
                                                : SteadyNow() + interval_ns_) {}

bool Cancellation::IsCancelled() {
  if (!status_.ok()) return true;
  const int64_t now = SteadyNow();
  if (now < next_look_ns_) return false;
  next_look_ns_ = now + interval_ns_;
  if (LookNow()) return true;
  GiveWay();
  return false;
}

bool Cancellation::LookNow() {
  if (status_.ok()) status_ = look_();
  return !status_.ok();
}

Cancellation::Look EndOfThreadTime(absl::Duration limit) {
  return [limit, begin = std::optional<absl::Duration>()]() mutable {
    timespec used{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
    const absl::Duration now = absl::DurationFromTimespec(used);
    if (!begin) begin = now;
    return now - *begin < limit ? absl::OkStatus() : absl::DeadlineExceededError("takes too long");
  };
}

Cancellation* Cancellation::Current() { return current; }

ScopedCancellation::ScopedCancellation(Cancellation* cancellation)
    : before_(std::exchange(current, cancellation)) {}

ScopedCancellation::~ScopedCancellation() { current = before_; }

bool IsCancelled() { return current != nullptr && current->IsCancelled(); }

absl::Status CheckCancelled() { return IsCancelled() ? current->status() : absl::OkStatus(); }

}  // namespace hypermap
