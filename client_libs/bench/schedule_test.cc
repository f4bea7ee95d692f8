#include "client_libs/bench/schedule.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace hypermap::bench {
namespace {

TEST(ScheduleTest, OperationsAreDueAtAConstantRateFromThePhase) {
  const SteadyTime start = SteadyTime::Now();
  const Schedule schedule(start, 5.0, 0.25);
  EXPECT_EQ(schedule.period(), absl::Milliseconds(200));
  EXPECT_EQ(schedule.At(0), start + absl::Milliseconds(50));
  EXPECT_EQ(schedule.At(1), start + absl::Milliseconds(250));
  EXPECT_EQ(schedule.At(5'000'000), start + absl::Milliseconds(50) + absl::Seconds(1'000'000));
}

TEST(ScheduleTest, AWindowHasAsManyOperationsAsItsDurationTimesTheRate) {
  const SteadyTime start = SteadyTime::Now();
  const RunTimes times{start, start + absl::Seconds(2), start + absl::Seconds(8),
                       start + absl::Seconds(60)};
  Random random = RandomOf(7, RandomRole::kEdit, 0);
  for (int i = 0; i < 100; ++i) {
    const Schedule schedule(start, 5.0, RandomPhase(random));
    int counted = 0;
    for (int64_t k = 0; schedule.At(k) < times.end; ++k) counted += times.Counts(schedule.At(k));
    EXPECT_EQ(counted, 30);
  }
}

TEST(ScheduleTest, RandomNumbersDependOnSeedRoleAndNumberOnly) {
  EXPECT_EQ(RandomOf(1, RandomRole::kPoints, 3)(), RandomOf(1, RandomRole::kPoints, 3)());
  std::set<uint64_t> seen;
  for (const uint64_t seed : {uint64_t{1}, uint64_t{2}, uint64_t{1} << 40U}) {
    for (const RandomRole role : {RandomRole::kObserve, RandomRole::kPoints, RandomRole::kEdit}) {
      for (uint64_t number = 0; number < 50; ++number) seen.insert(RandomOf(seed, role, number)());
    }
  }
  EXPECT_EQ(seen.size(), 3U * 3U * 50U);
}

TEST(ScheduleTest, PhasesSpreadOverThePeriod) {
  int in_first_half = 0;
  for (uint64_t number = 0; number < 1000; ++number) {
    Random random = RandomOf(1, RandomRole::kEdit, number);
    const double phase = RandomPhase(random);
    ASSERT_GE(phase, 0.0);
    ASSERT_LT(phase, 1.0);
    in_first_half += phase < 0.5;
  }
  EXPECT_GT(in_first_half, 400);
  EXPECT_LT(in_first_half, 600);
}

TEST(ScheduleTest, SleepEndsNotBeforeItsTime) {
  const SteadyTime until = SteadyTime::Now() + absl::Milliseconds(5);
  SleepUntil(until);
  EXPECT_GE(SteadyTime::Now(), until);
  SleepUntil(SteadyTime::InfinitePast());
}

}  // namespace
}  // namespace hypermap::bench
