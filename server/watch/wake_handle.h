// Ends the waits of a call that holds no thread while it waits.
#ifndef HYPERMAP_SERVER_WATCH_WAKE_HANDLE_H_
#define HYPERMAP_SERVER_WATCH_WAKE_HANDLE_H_

#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "base/sync/mutex.h"

namespace hypermap::server {

// Gives a waiting call its next turn. The callbacks that may end a wait (of a feed, a timer, a
// tick) share the handle, because they may come late, when the call is gone.
//
// Each wait ends with exactly one turn. It is started by the first callback, or by BeginWait itself
// if a callback came since the last BeginTurn. So no callback is lost that comes while the call is
// on a worker or in a write; at worst, a late callback of an earlier wait causes a turn with
// nothing to do. Everything that can end a wait is set up before BeginWait, and the caller of
// BeginWait does not touch the call afterwards. Thread safe.
class WakeHandle {
 public:
  using StartTurn = absl::AnyInvocable<void() const>;

  // `run_on_worker` gives the call a turn on a worker, and `run_here` a short one on the caller's
  // thread. Neither is called while the call has another owner, and so never when it is gone.
  WakeHandle(StartTurn run_on_worker, StartTurn run_here)
      : run_on_worker_(std::move(run_on_worker)), run_here_(std::move(run_here)) {}

  // If the call waits, gives it a turn: Wake on a worker, WakeHere a short one on this thread. If
  // it does not wait, keeps it from beginning to.
  void Wake();
  void WakeHere();
  // Forgets the callbacks so far, which this turn takes account of.
  void BeginTurn();
  // Makes the call wait, or run on a worker if a callback came since BeginTurn. When this returns,
  // another thread may own the call, and it may be gone.
  void BeginWait();

 private:
  // Returns whether the call was waiting. If so, the caller owns it now.
  bool EndWait();

  // The call is alive for the thread that has ended the wait, and in BeginWait.
  const StartTurn run_on_worker_;
  const StartTurn run_here_;
  Mutex mutex_;
  bool waiting_ ABSL_GUARDED_BY(mutex_) = false;
  bool woken_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WAKE_HANDLE_H_
