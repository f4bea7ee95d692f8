#include "base/time/clock.h"

#include <unistd.h>

#include <ctime>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

namespace hypermap {
namespace {

class MachineClock : public Clock {
 public:
  MachineClock() {
    std::ifstream file("/proc/sys/kernel/random/boot_id");
    if (!std::getline(file, boot_id_) || boot_id_.empty()) {
      // Comparable with no other process.
      boot_id_ = absl::StrCat("process ", getpid(), " of ", absl::ToUnixNanos(absl::Now()));
    }
  }

  absl::Time Wall() const override { return absl::Now(); }
  absl::Duration SinceBoot() const override {
    timespec time{};
    clock_gettime(CLOCK_BOOTTIME, &time);
    return absl::DurationFromTimespec(time);
  }
  const std::string& BootId() const override { return boot_id_; }

 private:
  std::string boot_id_;
};

}  // namespace

const Clock& SystemClock() {
  static const auto* const clock = new MachineClock;
  return *clock;
}

}  // namespace hypermap
