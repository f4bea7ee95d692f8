// A task that one thread hands to another and waits for.
#ifndef HYPERMAP_SERVER_SESSION_AWAITED_TASK_H_
#define HYPERMAP_SERVER_SESSION_AWAITED_TASK_H_

#include <optional>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "base/cancellation/cancellation.h"
#include "base/sync/mutex.h"

namespace hypermap::server {

// The state of the task. The thread that waits gives it up if its own caller goes before the task
// has begun. Thread safe.
class AwaitedTask {
 public:
  // Returns false if the task was given up. Otherwise End must follow.
  bool Begin() {
    const MutexLock lock(&mutex_);
    has_begun_ = true;
    return !is_given_up_;
  }
  void End(absl::Status status) {
    const MutexLock lock(&mutex_);
    result_ = std::move(status);
    ended_.NotifyOne();
  }
  // Returns the argument of End, or the error of this thread's cancellation.
  absl::Status Await() {
    const MutexLock lock(&mutex_);
    while (!result_) {
      // A task that has begun uses the cancellation itself.
      Cancellation* const caller = has_begun_ ? nullptr : Cancellation::Current();
      is_given_up_ = caller != nullptr && caller->LookNow();
      if (is_given_up_) return caller->status();
      ended_.WaitFor(&mutex_, kLookPeriod);
    }
    return *result_;
  }

 private:
  // The thread that waits looks this often whether its own caller has gone.
  static constexpr absl::Duration kLookPeriod = absl::Milliseconds(20);

  Mutex mutex_;
  CondVar ended_;
  bool has_begun_ ABSL_GUARDED_BY(mutex_) = false;
  bool is_given_up_ ABSL_GUARDED_BY(mutex_) = false;
  std::optional<absl::Status> result_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_AWAITED_TASK_H_
