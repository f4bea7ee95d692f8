// Logs problems of messages without filling the log.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_PROBLEM_LOG_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_PROBLEM_LOG_H_

#include <cstdint>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"

namespace hypermap::ros2 {

// Counts problems by their kind, and logs each kind at most once in ten seconds, with its count
// since the start and the newest problem. Thread safe.
class ProblemLog {
 public:
  // `kind` is a text of the program, the same for all problems of a kind.
  void Note(absl::string_view kind, const absl::Status& problem, int64_t count = 1);

  // The number of problems of a kind so far.
  int64_t CountOf(absl::string_view kind) const;

 private:
  struct Kind {
    int64_t count = 0;
    SteadyTime logged = SteadyTime::InfinitePast();
  };

  mutable Mutex mutex_;
  std::map<std::string, Kind, std::less<>> kinds_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_PROBLEM_LOG_H_
