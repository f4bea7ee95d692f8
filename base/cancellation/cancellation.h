// Gives up work whose caller has gone away or whose deadline has passed.
//
// While a thread works for a call, it has the call's Cancellation. Loops ask for it, however deep
// they are:
//
//   Cancellation cancellation([&] { return CheckWanted(*context); });
//   const ScopedCancellation here(&cancellation);
//   HYPERMAP_ASSIGN_OR_RETURN(ImportedMap imported, DecodeHmap(data, limits));
//
// A loop whose length a request or a file decides calls CheckCancelled, about as often as each
// 10 microseconds to 10 milliseconds of its work. A function that can't return a status calls
// IsCancelled instead, breaks off, and returns any value of its type. The first of its callers that
// can return a status must call CheckCancelled before it uses the value, keeps it or shows it to
// another call. That is safe because a cancellation is final: once it was reported, all later calls
// for the same Cancellation report it.
//
// Such work also lets waiting threads run (GiveWay), about four times in a millisecond.
//
// State that outlives the call, such as a cache, must not keep values from work that was given up.
// Work that would leave such state half changed runs to its end below ScopedCancellation(nullptr).
#ifndef HYPERMAP_BASE_CANCELLATION_CANCELLATION_H_
#define HYPERMAP_BASE_CANCELLATION_CANCELLATION_H_

#include <cstdint>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/time/time.h"

namespace hypermap {

// Tells whether the result of one call is still wanted. Used by one thread at a time; may be handed
// from thread to thread.
class Cancellation {
 public:
  // Returns OK, or the error with which the call ends: CANCELLED or DEADLINE_EXCEEDED.
  using Look = absl::AnyInvocable<absl::Status()>;

  // When the first look is: work that is mostly shorter than the interval need not look at all.
  enum class FirstLook { kAtOnce, kAfterInterval };

  static constexpr absl::Duration kInterval = absl::Microseconds(250);

  // `look` is called at most once in `interval`, because it may be slow, and not any more after it
  // has returned an error.
  explicit Cancellation(Look look, absl::Duration interval = kInterval,
                        FirstLook first = FirstLook::kAtOnce);
  Cancellation(const Cancellation&) = delete;
  Cancellation& operator=(const Cancellation&) = delete;

  // Looks if it is time to, and then lets waiting threads run. Costs some 30 ns if it is not time
  // yet.
  bool IsCancelled();
  // Looks whatever the interval, and lets no other thread run: for a thread that holds a lock.
  bool LookNow();
  // The error that a look has returned; OK before. Does not look.
  const absl::Status& status() const { return status_; }

  // The cancellation for which this thread works now; null if there is none.
  static Cancellation* Current();

 private:
  Look look_;
  const int64_t interval_ns_;
  int64_t next_look_ns_;  // of a clock that never goes back
  absl::Status status_;
};

// Returns a look for work that may use this much processor time of its thread, counted from the
// first look. Time in which other threads run does not count: on a busy machine, short work is not
// given up for it.
Cancellation::Look EndOfThreadTime(absl::Duration limit);

// Sets the cancellation of this thread until it is destroyed, then restores the one before. Null:
// work in this scope is not given up.
class ScopedCancellation {
 public:
  explicit ScopedCancellation(Cancellation* cancellation);
  ~ScopedCancellation();
  ScopedCancellation(const ScopedCancellation&) = delete;
  ScopedCancellation& operator=(const ScopedCancellation&) = delete;

 private:
  Cancellation* const before_;
};

// Returns whether the work of this thread should be given up. False, and fast, without a
// cancellation.
bool IsCancelled();
// OK, or the error of the cancellation of this thread.
absl::Status CheckCancelled();

}  // namespace hypermap

#endif  // HYPERMAP_BASE_CANCELLATION_CANCELLATION_H_
