#include "base/cancellation/cancellation.h"

#include <chrono>
#include <limits>
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

Cancellation::Cancellation(Look look, absl::Duration interval)
    : look_(std::move(look)),
      interval_ns_(absl::ToInt64Nanoseconds(interval)),
      next_look_ns_(std::numeric_limits<int64_t>::min()) {}

bool Cancellation::IsCancelled() {
  if (!status_.ok()) return true;
  const int64_t now = SteadyNow();
  if (now < next_look_ns_) return false;
  GiveWay();
  next_look_ns_ = now + interval_ns_;
  status_ = look_();
  return !status_.ok();
}

Cancellation* Cancellation::Current() { return current; }

ScopedCancellation::ScopedCancellation(Cancellation* cancellation)
    : before_(std::exchange(current, cancellation)) {}

ScopedCancellation::~ScopedCancellation() { current = before_; }

bool IsCancelled() { return current != nullptr && current->IsCancelled(); }

absl::Status CheckCancelled() { return IsCancelled() ? current->status() : absl::OkStatus(); }

}  // namespace hypermap
