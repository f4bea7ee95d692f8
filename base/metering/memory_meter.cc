#include "base/metering/memory_meter.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap {
namespace {

// The account is charged in steps of at least this size.
constexpr int64_t kStepBytes = 64 << 10;

thread_local MemoryMeter* current = nullptr;

}  // namespace

absl::Status MemoryCap::ChargeMemory(int64_t bytes) {
  if (most_bytes_ > 0 && bytes > most_bytes_ - charged_) {
    return absl::ResourceExhaustedError(
        absl::StrCat("takes more than --", flag_, ", ", most_bytes_, " bytes, of memory"));
  }
  charged_ += bytes;
  return absl::OkStatus();
}

absl::Status MemoryMeter::Take(int64_t bytes) {
  const int64_t missing = taken_ + bytes - kFreeBytes - charged_;
  if (missing > 0) {
    const int64_t step = std::max(missing, kStepBytes);
    HYPERMAP_RETURN_IF_ERROR(account_->ChargeMemory(step));
    charged_ += step;
  }
  taken_ += bytes;
  return absl::OkStatus();
}

void MemoryMeter::GiveBack(int64_t bytes) {
  taken_ -= bytes;
  const int64_t needed = std::max<int64_t>(taken_ - kFreeBytes, 0);
  if (charged_ <= needed) return;
  account_->FreeMemory(charged_ - needed);
  charged_ = needed;
}

MemoryMeter* MemoryMeter::Current() { return current; }

ScopedMeter::ScopedMeter(MemoryMeter* meter) : before_(std::exchange(current, meter)) {}

ScopedMeter::~ScopedMeter() { current = before_; }

TemporaryMemory::TemporaryMemory()
    : meter_(current), before_(meter_ == nullptr ? 0 : meter_->taken()) {}

TemporaryMemory::~TemporaryMemory() {
  if (meter_ != nullptr) meter_->GiveBack(meter_->taken() - before_);
}

absl::Status TakeMemory(int64_t bytes) {
  return current == nullptr ? absl::OkStatus() : current->Take(bytes);
}

}  // namespace hypermap
