// Long work that lets waiting threads run.
#ifndef HYPERMAP_BASE_CANCELLATION_GIVE_WAY_H_
#define HYPERMAP_BASE_CANCELLATION_GIVE_WAY_H_

#include <chrono>
#include <thread>

namespace hypermap {

// Yields the processor if the calling thread has not done so for a quarter of a millisecond.
// Otherwise a thread that wakes up may have to wait for the next tick of the kernel's timer, which
// comes every 4 ms on many systems, whatever the priorities of both. To be called in long work, as
// often as suits it: costs some 30 ns, and less than a microsecond when it yields and nobody waits.
inline void GiveWay() {
  using Clock = std::chrono::steady_clock;
  thread_local Clock::time_point next = Clock::time_point::min();
  const Clock::time_point now = Clock::now();
  if (now < next) return;
  // Not at the first call of a thread.
  if (next != Clock::time_point::min()) std::this_thread::yield();
  next = now + std::chrono::microseconds(250);
}

}  // namespace hypermap

#endif  // HYPERMAP_BASE_CANCELLATION_GIVE_WAY_H_
