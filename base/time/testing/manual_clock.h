// A Clock that a test sets.
#ifndef HYPERMAP_BASE_TIME_TESTING_MANUAL_CLOCK_H_
#define HYPERMAP_BASE_TIME_TESTING_MANUAL_CLOCK_H_

#include <list>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "base/time/clock.h"

namespace hypermap {

// Stands still unless a method moves it. Thread safe.
class ManualClock : public Clock {
 public:
  explicit ManualClock(absl::Time wall = absl::FromUnixSeconds(1'000'000)) : wall_(wall) {
    boot_ids_.emplace_back("boot 1");
  }

  absl::Time Wall() const override {
    const MutexLock lock(&mutex_);
    return wall_;
  }
  absl::Duration SinceBoot() const override {
    const MutexLock lock(&mutex_);
    return since_boot_;
  }
  const std::string& BootId() const override {
    const MutexLock lock(&mutex_);
    return boot_ids_.back();
  }

  // Lets time pass.
  void Advance(absl::Duration by) {
    const MutexLock lock(&mutex_);
    if (!frozen_) wall_ += by;
    since_boot_ += by;
  }
  // Sets the wall clock, as an administrator does.
  void SetWall(absl::Time wall) {
    const MutexLock lock(&mutex_);
    wall_ = wall;
  }
  void Jump(absl::Duration by) {
    const MutexLock lock(&mutex_);
    wall_ += by;
  }
  // A frozen wall clock stands still while time passes.
  void Freeze(bool frozen) {
    const MutexLock lock(&mutex_);
    frozen_ = frozen;
  }
  // Starts the machine again after it was off. The wall clock ran on.
  void Reboot(absl::Duration off) {
    const MutexLock lock(&mutex_);
    wall_ += off;
    since_boot_ = absl::Seconds(5);
    // The old ids are kept, because views of them were handed out.
    boot_ids_.push_back(absl::StrCat("boot ", boot_ids_.size() + 1));
  }

 private:
  mutable Mutex mutex_;
  absl::Time wall_ ABSL_GUARDED_BY(mutex_);
  absl::Duration since_boot_ ABSL_GUARDED_BY(mutex_) = absl::Hours(1);
  bool frozen_ ABSL_GUARDED_BY(mutex_) = false;
  std::list<std::string> boot_ids_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap

#endif  // HYPERMAP_BASE_TIME_TESTING_MANUAL_CLOCK_H_
