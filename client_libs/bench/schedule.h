// The times at which the operations of a client are due.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_SCHEDULE_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_SCHEDULE_H_

#include <cstdint>
#include <random>

#include "absl/time/time.h"
#include "base/sync/steady_time.h"

namespace hypermap::bench {

using Random = std::mt19937_64;

// The uses of random numbers in a load.
enum class RandomRole { kSite, kObserve, kPoints, kClaim, kEdit };

// Returns a generator of random numbers for one client, which depends on the arguments only.
Random RandomOf(uint64_t seed, RandomRole role, uint64_t number);

// The periods of a run. Operations that are due in [measure_from, end) count. At `give_up`, clients
// stop to wait for answers.
struct RunTimes {
  SteadyTime start = SteadyTime::InfiniteFuture();
  SteadyTime measure_from = SteadyTime::InfiniteFuture();
  SteadyTime end = SteadyTime::InfiniteFuture();
  SteadyTime give_up = SteadyTime::InfiniteFuture();

  bool Counts(SteadyTime due) const { return due >= measure_from && due < end; }
};

// An open-loop schedule: operations are due at a constant rate, whether or not the ones before are
// answered. Latencies that are measured from these times therefore show the time that an operation
// waited for a slow one before it.
class Schedule {
 public:
  // `phase` in [0, 1): the share of a period before the first operation. REQUIRES: hz > 0.
  Schedule(SteadyTime start, double hz, double phase);

  // When operation `k` is due; k counts from 0.
  SteadyTime At(int64_t k) const { return first_ + period_ * k; }
  absl::Duration period() const { return period_; }

 private:
  absl::Duration period_;
  SteadyTime first_;
};

// Draws a phase.
double RandomPhase(Random& random);

// Waits until a time. Returns at once if it has passed.
void SleepUntil(SteadyTime time);

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_SCHEDULE_H_
