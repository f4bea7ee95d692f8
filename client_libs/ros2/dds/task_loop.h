// Tasks that become due, one after another on a thread. Only for the sources of this room.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_DDS_TASK_LOOP_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_DDS_TASK_LOOP_H_

#include <map>
#include <memory>
#include <optional>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "base/sync/executor.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"

namespace hypermap::ros2 {

// Thread safe.
class TaskLoop {
 public:
  using Task = absl::AnyInvocable<void()>;

  // RESOURCE_EXHAUSTED if no thread can be started.
  absl::Status Start();
  // Tasks that are not due yet are forgotten.
  ~TaskLoop();

  SteadyTime Now() const { return ThreadExecutor().Now(); }
  // A task may add tasks.
  void Add(SteadyTime due, Task task);

 private:
  std::optional<absl::Duration> Step();

  Mutex mutex_;
  bool ends_ ABSL_GUARDED_BY(mutex_) = false;
  std::multimap<SteadyTime, Task> tasks_ ABSL_GUARDED_BY(mutex_);
  std::unique_ptr<Executor::Running> running_;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_DDS_TASK_LOOP_H_
