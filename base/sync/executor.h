// Runs loops that sleep while they have nothing to do.
#ifndef HYPERMAP_BASE_SYNC_EXECUTOR_H_
#define HYPERMAP_BASE_SYNC_EXECUTOR_H_

#include <memory>
#include <optional>

#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/steady_time.h"
#include "base/sync/thread_name.h"

namespace hypermap {

// The owner of a loop knows what a step does and when the next one is due; the executor knows where
// and when it runs. A server gives each loop a thread. A simulation runs the steps of all loops on
// one thread, in an order that it chooses.
class Executor {
 public:
  // Does the work that is there and does not wait for more. Returns the longest time until the next
  // step, which may be zero or negative; nullopt once the loop has ended. The steps of a loop never
  // run at the same time.
  using Step = absl::AnyInvocable<std::optional<absl::Duration>()>;

  // A loop that was started.
  class Running {
   public:
    // Calls Join.
    virtual ~Running() = default;
    // Makes the next step due. After a call during a step, another step follows it. Thread safe;
    // may be called by a step.
    virtual void Wake() = 0;
    // Returns when the loop has ended. Must be called by one thread, which is not the loop's.
    virtual void Join() = 0;
  };

  virtual ~Executor() = default;

  // The time by which loops sleep. What a loop paces, limits or waits for is measured by it. Thread
  // safe.
  virtual SteadyTime Now() const = 0;

  // Starts a loop, whose first step is due at once. RESOURCE_EXHAUSTED if the machine can run no
  // more loops.
  virtual absl::StatusOr<std::unique_ptr<Running>> Start(ThreadName name, Step step) = 0;
};

// Runs each loop on a thread of its own. Never destroyed. Thread safe.
Executor& ThreadExecutor();

}  // namespace hypermap

#endif  // HYPERMAP_BASE_SYNC_EXECUTOR_H_
