#include "base/time/server_clock.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "base/time/testing/manual_clock.h"

namespace hypermap {
namespace {

constexpr absl::Duration kYear = absl::Hours(24 * 365);

class ServerClockTest : public ::testing::Test {
 protected:
  // Lets time pass in steps, after each of which the server reads its clock.
  void Pass(absl::Duration time, absl::Duration step = absl::Seconds(10)) {
    for (; time > absl::ZeroDuration(); time -= step) {
      machine_.Advance(std::min(step, time));
      truth_ += std::min(step, time);
      clock_.Now();
    }
  }
  // Returns by how much Now() differs from the true time.
  absl::Duration Error() { return clock_.Now() - truth_; }

  ManualClock machine_;
  absl::Time truth_ = machine_.Wall();
  ServerClock clock_{&machine_};
};

TEST_F(ServerClockTest, C1GoesWithTheWallClock) {
  EXPECT_EQ(Error(), absl::ZeroDuration());
  Pass(absl::Hours(1));
  EXPECT_EQ(Error(), absl::ZeroDuration());
  EXPECT_TRUE(clock_.IsSettled());
  EXPECT_FALSE(clock_.state().jump.has_value());
  EXPECT_EQ(clock_.state().num_jumps, 0);
}

// Otherwise a thread that is interrupted between the two clocks would draw the clock back.
TEST_F(ServerClockTest, AReadingThatTookAWhileIsNoErrorOfTheClock) {
  class SlowClock : public Clock {
   public:
    absl::Time Wall() const override {
      const absl::Time wall = machine.Wall();
      machine.Advance(took);
      return wall;
    }
    absl::Duration SinceBoot() const override { return machine.SinceBoot(); }
    const std::string& BootId() const override { return machine.BootId(); }

    mutable ManualClock machine;
    absl::Duration took;
  };
  SlowClock slow;
  ServerClock clock(&slow);
  const ServerClock::Instant begin = clock.Read();
  slow.took = absl::Milliseconds(50);
  for (int i = 0; i < 100; ++i) {
    const ServerClock::Instant instant = clock.Read();
    EXPECT_EQ(instant.now - begin.now, instant.since_boot - begin.since_boot);
  }
  // An error that is larger than that is made up for.
  slow.machine.Jump(-absl::Milliseconds(60));
  for (int i = 0; i < 200; ++i) clock.Now();
  const ServerClock::Instant end = clock.Read();
  EXPECT_EQ(end.now - begin.now, end.since_boot - begin.since_boot - absl::Milliseconds(60));
}

TEST_F(ServerClockTest, TimesAreWholeNanosecondsWhileItIsDrawnTowardsTheWallClock) {
  machine_.Jump(absl::Milliseconds(1));
  for (int i = 0; i < 100; ++i) {
    machine_.Advance(absl::Nanoseconds(130 + i));
    const absl::Time now = clock_.Now();
    EXPECT_EQ(now, absl::FromUnixNanos(absl::ToUnixNanos(now)));
  }
}

TEST_F(ServerClockTest, C1YearAheadForTwoMinutesAndBackIsNotFollowed) {
  machine_.Jump(kYear);
  EXPECT_EQ(Error(), absl::ZeroDuration());
  Pass(absl::Minutes(2));
  EXPECT_EQ(Error(), absl::ZeroDuration());
  const ServerClock::State state = clock_.state();
  ASSERT_TRUE(state.jump.has_value());
  EXPECT_EQ(state.jump->size, kYear);
  EXPECT_EQ(state.jump->age, absl::Minutes(2));
  machine_.Jump(-kYear);
  EXPECT_EQ(Error(), absl::ZeroDuration());
  EXPECT_FALSE(clock_.state().jump.has_value());
  EXPECT_EQ(clock_.state().num_jumps, 1);
  EXPECT_EQ(clock_.state().num_followed, 0);
}

TEST_F(ServerClockTest, C1YearBackForTwoMinutesIsNotFollowed) {
  machine_.Jump(-kYear);
  Pass(absl::Minutes(2));
  EXPECT_EQ(Error(), absl::ZeroDuration());
  EXPECT_EQ(clock_.state().jump->size, -kYear);
  EXPECT_FALSE(clock_.IsSettled());
  machine_.Jump(kYear);
  Pass(ServerClock::kSettle);
  EXPECT_EQ(Error(), absl::ZeroDuration());
  EXPECT_TRUE(clock_.IsSettled());
}

TEST_F(ServerClockTest, C1JumpThatLastsIsFollowedInBothDirections) {
  for (const absl::Duration jump : {kYear, -kYear, absl::Seconds(5)}) {
    machine_.Jump(jump);
    truth_ += jump;
    clock_.Now();
    Pass(ServerClock::kSettle - absl::Seconds(10));
    EXPECT_EQ(Error(), -jump);
    Pass(absl::Seconds(10));
    EXPECT_EQ(Error(), absl::ZeroDuration());
    EXPECT_TRUE(clock_.IsSettled());
  }
  EXPECT_EQ(clock_.state().num_jumps, 3);
  EXPECT_EQ(clock_.state().num_followed, 3);
}

TEST_F(ServerClockTest, C1FrozenWallClockIsNeverFollowed) {
  machine_.Freeze(true);
  Pass(absl::Hours(24));
  // Until the wall clock was farther away than kInStep, it drew the clock a little.
  EXPECT_LT(absl::AbsDuration(Error()), absl::Seconds(1));
  EXPECT_EQ(clock_.state().num_followed, 0);
  // Logged about once an hour.
  EXPECT_LE(clock_.state().num_jumps, 24);
  machine_.SetWall(truth_);
  machine_.Freeze(false);
  Pass(absl::Minutes(2));
  EXPECT_EQ(Error(), absl::ZeroDuration());
  EXPECT_FALSE(clock_.state().jump.has_value());
}

TEST_F(ServerClockTest, C1SmallErrorsAreWornOffAtABoundedRateAndNeverBackwards) {
  machine_.Jump(-absl::Milliseconds(500));
  truth_ -= absl::Milliseconds(500);
  absl::Time before = clock_.Now();
  for (int i = 0; i < 100; ++i) {
    Pass(absl::Seconds(1), absl::Milliseconds(100));
    const absl::Duration went = clock_.Now() - before;
    EXPECT_GE(went, absl::Milliseconds(989));
    EXPECT_LE(went, absl::Seconds(1));
    before = clock_.Now();
  }
  EXPECT_EQ(Error(), absl::ZeroDuration());
  EXPECT_EQ(clock_.state().num_jumps, 0);
}

TEST_F(ServerClockTest, C1ServerThatIsStartedInAJumpGoesOnFromWhatTheLastOneSaid) {
  const std::string boot = machine_.BootId();
  const absl::Duration at = machine_.SinceBoot();
  const absl::Time then = clock_.Now();
  machine_.Advance(absl::Minutes(3));
  truth_ += absl::Minutes(3);
  machine_.Jump(kYear);
  ServerClock next(&machine_);
  EXPECT_EQ(next.Now(), truth_ + kYear);
  // Several maps tell it what they know; readings of another boot tell nothing.
  next.Resume("another boot", at, then - absl::Hours(7));
  next.Resume(boot, at - absl::Minutes(1), then - absl::Minutes(1) + absl::Milliseconds(100));
  next.Resume(boot, at, then);
  EXPECT_LE(absl::AbsDuration(next.Now() - truth_), absl::Milliseconds(100));
  EXPECT_EQ(next.state().num_jumps, 1);
  EXPECT_EQ(next.state().num_followed, 0);
  // An older reading changes nothing.
  next.Resume(boot, at - absl::Hours(1), then);
  EXPECT_LE(absl::AbsDuration(next.Now() - truth_), absl::Milliseconds(100));
}

TEST_F(ServerClockTest, C1ManyThreadsReadIt) {
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([this] {
      for (int k = 0; k < 1000; ++k) {
        // The test advances the clock by one second in all.
        EXPECT_LE(absl::AbsDuration(clock_.Now() - machine_.Wall()), absl::Seconds(2));
      }
    });
  }
  for (int i = 0; i < 1000; ++i) machine_.Advance(absl::Milliseconds(1));
  for (std::thread& thread : threads) thread.join();
}

TEST(SystemClockTest, C1BootClockDoesNotGoBack) {
  const Clock& clock = SystemClock();
  EXPECT_FALSE(clock.BootId().empty());
  const absl::Duration before = clock.SinceBoot();
  EXPECT_GT(before, absl::ZeroDuration());
  EXPECT_GE(clock.SinceBoot(), before);
  EXPECT_GT(clock.Wall(), absl::FromUnixSeconds(1'600'000'000));
}

}  // namespace
}  // namespace hypermap
