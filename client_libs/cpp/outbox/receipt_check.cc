#include "client_libs/cpp/outbox/receipt_check.h"

#include <sys/timex.h>

#include <ctime>
#include <fstream>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client_libs/cpp/client.h"

namespace hypermap::client {
namespace {

std::string ReadBootId() {
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string id;
  if (std::getline(file, id) && !id.empty()) return id;
  // Comparable with no other process.
  return NewRequestId();
}

// The kernel takes the wall clock for wrong from the boot, and from each setting by hand, until a
// time server corrects it, and again when none has done so for hours.
bool IsSynchronized() {
  timex state{};
  const int answer = adjtimex(&state);
  return answer != -1 && answer != TIME_ERROR;
}

// The time from `sent` to `now`; nullopt if the clocks don't tell.
std::optional<absl::Duration> TimeBetween(const storage::SendTime& sent,
                                          const storage::SendTime& now) {
  if (sent.boot_id == now.boot_id) return now.since_boot - sent.since_boot;
  // Requests that an earlier version sent have nothing but the wall clock.
  const bool wall_tells = sent.boot_id.empty() || (sent.synchronized && now.synchronized);
  if (!wall_tells || now.wall < sent.wall) return std::nullopt;
  return now.wall - sent.wall;
}

}  // namespace

storage::SendTime ReadClocks() {
  static const auto* const boot_id = new std::string(ReadBootId());
  timespec since_boot{};
  clock_gettime(CLOCK_BOOTTIME, &since_boot);
  return {absl::Now(), IsSynchronized(), *boot_id, absl::DurationFromTimespec(since_boot)};
}

absl::Status ReceiptCheck::Check(const storage::SendTime& sent, const storage::SendTime& now) {
  const std::optional<absl::Duration> age = TimeBetween(sent, now);
  if (age && *age <= max_age_) return absl::OkStatus();
  if (!age && sent.synchronized && !now.synchronized) {
    if (!waiting_since_) waiting_since_ = now.since_boot;
    if (now.since_boot - *waiting_since_ < kSynchronization) {
      return absl::UnavailableError(
          "an edit was sent before this machine was started: waits for a time server to set the "
          "clock");
    }
  }
  return absl::AbortedError(
      absl::StrCat("sent at ", absl::FormatTime(sent.wall),
                   ", and its answer was lost: whether it was carried out is not known any more"));
}

}  // namespace hypermap::client
