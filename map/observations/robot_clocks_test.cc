#include "map/observations/robot_clocks.h"

#include <gtest/gtest.h>

#include <random>

#include "absl/strings/str_cat.h"

namespace hypermap {
namespace {

const absl::Time kArrival = absl::FromUnixSeconds(1'700'000'000);

TEST(ClockSkewTest, C2IsTheLargestOfWhatTheMessagesTell) {
  ClockSkew skew;
  EXPECT_EQ(skew.estimate(), absl::ZeroDuration());
  // A clock that is two minutes ahead, and messages that take 20 ms to 3 s.
  std::mt19937 random(1);
  std::uniform_int_distribution<int> delay_ms(20, 3000);
  for (int i = 0; i < 200; ++i) {
    const absl::Time arrival = kArrival + absl::Seconds(i);
    skew.Add(arrival - absl::Milliseconds(i == 90 ? 20 : delay_ms(random)) + absl::Minutes(2),
             arrival);
  }
  EXPECT_EQ(skew.estimate(), absl::Minutes(2) - absl::Milliseconds(20));
}

TEST(ClockSkewTest, C2ClockThatIsBehindHasANegativeSkew) {
  ClockSkew skew;
  skew.Add(kArrival - absl::Seconds(30), kArrival);
  skew.Add(kArrival - absl::Seconds(32), kArrival);
  EXPECT_EQ(skew.estimate(), -absl::Seconds(30));
}

TEST(ClockSkewTest, C2MessagesThatWereKeptBackDoNotAffectIt) {
  ClockSkew skew;
  for (int i = 10; i > 0; --i) skew.Add(kArrival - absl::Hours(i), kArrival);
  skew.Add(kArrival + absl::Seconds(1), kArrival);
  EXPECT_EQ(skew.estimate(), absl::Seconds(1));
}

TEST(ClockSkewTest, C2ClockThatWasSetIsFollowedWithinTwoWindows) {
  ClockSkew skew;
  absl::Time arrival = kArrival;
  for (int i = 0; i < 10; ++i, arrival += absl::Minutes(1)) {
    skew.Add(arrival + absl::Hours(1), arrival);
  }
  const absl::Time set = arrival;
  for (; arrival < set + 2 * ClockSkew::kWindow + absl::Minutes(1); arrival += absl::Minutes(1)) {
    skew.Add(arrival, arrival);
  }
  EXPECT_EQ(skew.estimate(), absl::ZeroDuration());
  // A pause that is longer than both windows forgets everything.
  skew.Add(arrival + absl::Hours(10) - absl::Seconds(5), arrival + absl::Hours(10));
  EXPECT_EQ(skew.estimate(), -absl::Seconds(5));
}

TEST(RobotClocksTest, C2KeepsEachRobotsOwnSkew) {
  RobotClocks clocks;
  EXPECT_EQ(clocks.Add("rogue", kArrival + absl::Seconds(598), kArrival), absl::Seconds(598));
  EXPECT_EQ(clocks.Add("cart", kArrival, kArrival), absl::ZeroDuration());
  const auto robots = clocks.List();
  ASSERT_EQ(robots.size(), 2u);
  EXPECT_EQ(robots[0].name, "cart");
  EXPECT_EQ(robots[1].name, "rogue");
  EXPECT_EQ(robots[1].skew, absl::Seconds(598));
  EXPECT_EQ(robots[1].last_seen, kArrival);
}

TEST(RobotClocksTest, C2ForgetsTheRobotsThatWereSilentLongest) {
  RobotClocks clocks;
  clocks.Add("first", kArrival, kArrival);
  clocks.Add("second", kArrival, kArrival);
  for (size_t i = 2; i < RobotClocks::kMaxRobots; ++i) {
    clocks.Add(absl::StrCat("robot ", i), kArrival, kArrival);
  }
  clocks.Add("first", kArrival + absl::Seconds(1), kArrival);
  clocks.Add("one more", kArrival, kArrival);
  const auto robots = clocks.List();
  ASSERT_EQ(robots.size(), RobotClocks::kMaxRobots);
  EXPECT_EQ(robots[0].name, "one more");
  EXPECT_EQ(robots[1].name, "first");
  EXPECT_EQ(robots.back().name, "robot 2");
}

}  // namespace
}  // namespace hypermap
