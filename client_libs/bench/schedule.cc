#include "client_libs/bench/schedule.h"

#include "absl/time/clock.h"

namespace hypermap::bench {

Random RandomOf(uint64_t seed, RandomRole role, uint64_t number) {
  std::seed_seq words{seed & 0xffffffffU, seed >> 32U, static_cast<uint64_t>(role), number};
  return Random(words);
}

Schedule::Schedule(SteadyTime start, double hz, double phase)
    : period_(absl::Seconds(1.0 / hz)), first_(start + period_ * phase) {}

double RandomPhase(Random& random) {
  return std::uniform_real_distribution<double>(0.0, 1.0)(random);
}

void SleepUntil(SteadyTime time) {
  const absl::Duration left = time - SteadyTime::Now();
  if (left > absl::ZeroDuration()) absl::SleepFor(left);
}

}  // namespace hypermap::bench
