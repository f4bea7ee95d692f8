// The clocks of the machine, behind an interface that tests replace.
#ifndef HYPERMAP_BASE_TIME_CLOCK_H_
#define HYPERMAP_BASE_TIME_CLOCK_H_

#include <string>

#include "absl/time/time.h"

namespace hypermap {

// Two clocks. The wall clock tells the date, but anybody may set it at any time, by any amount. The
// boot clock can't be set: it tells the time that really passed since the machine was started, with
// the time for which it was suspended. Thread safe.
class Clock {
 public:
  virtual ~Clock() = default;

  virtual absl::Time Wall() const = 0;
  virtual absl::Duration SinceBoot() const = 0;
  // Readings of SinceBoot can be compared with each other while this is the same, also those of
  // different processes. Not empty.
  virtual const std::string& BootId() const = 0;
};

// The clocks of this machine. Never destroyed.
const Clock& SystemClock();

}  // namespace hypermap

#endif  // HYPERMAP_BASE_TIME_CLOCK_H_
