// Time marks for tests.
#ifndef HYPERMAP_STORAGE_CONFORMANCE_TESTING_TIME_MARK_H_
#define HYPERMAP_STORAGE_CONFORMANCE_TESTING_TIME_MARK_H_

#include <cstdint>

#include "absl/time/time.h"
#include "storage/map_store.h"

namespace hypermap::storage {

// A mark after `seconds` of the map's life, during which its commit times ran twice as fast.
inline TimeMark MarkAt(int64_t seconds) {
  TimeMark mark;
  mark.revision = seconds;
  mark.commit_time = absl::FromUnixSeconds(2 * seconds);
  mark.passed = absl::Seconds(seconds);
  mark.lived = absl::Seconds(seconds) + absl::Nanoseconds(1);
  mark.server_time = absl::FromUnixSeconds(-seconds);
  mark.boot_id = "boot";
  mark.since_boot = absl::Nanoseconds(seconds);
  return mark;
}

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_CONFORMANCE_TESTING_TIME_MARK_H_
