#include "server/presence/map_robots.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "base/time/testing/manual_clock.h"
#include "tests/support/random_map.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr int64_t kManyItems = 1000;
constexpr int64_t kManyBytes = 1 << 20;

class MapRobotsTest : public ::testing::Test {
 protected:
  static Limits SmallLimits() {
    Limits limits;
    limits.max_robots = 3;
    limits.robot_online_seconds = 10;
    limits.robot_memory_seconds = 60;
    return limits;
  }

  RobotReport ReportOf(const std::string& robot, double x = 0) {
    RobotReport report;
    report.robot = robot;
    report.stamp = server_clock_.Now();
    report.frame_from_robot = PlanarTransform(x, 0, 0);
    return report;
  }
  void Report(const std::string& robot, double x = 0) {
    const absl::StatusOr<bool> accepted = robots_.Report(ReportOf(robot, x));
    ASSERT_TRUE(accepted.ok()) << accepted.status();
    EXPECT_TRUE(*accepted);
  }
  // The robots with "+" if they are online and "-" otherwise.
  static std::vector<std::string> Names(const std::vector<RobotPresence>& robots) {
    std::vector<std::string> names;
    for (const RobotPresence& robot : robots) {
      names.push_back((robot.online ? "+" : "-") + robot.report.robot);
    }
    return names;
  }
  MapRobots::Changes ReadAfter(MapRobots::ChangeNumber after) {
    return robots_.ReadAfter(after, kManyItems, kManyBytes);
  }

  ManualClock clock_;
  ServerClock server_clock_{&clock_};
  MapRobots robots_{SmallLimits(), &server_clock_};
};

TEST_F(MapRobotsTest, KeepsTheNewestReportOfEachRobot) {
  Report("b", 1);
  Report("a", 2);
  clock_.Advance(absl::Seconds(1));
  Report("b", 3);
  const std::vector<RobotPresence> robots = robots_.List();
  EXPECT_THAT(Names(robots), ElementsAre("+a", "+b"));
  EXPECT_EQ(robots[1].report.frame_from_robot.x(), 3);
  EXPECT_EQ(robots[1].seen_at, server_clock_.Now());
  EXPECT_EQ(robots[0].seen_at, server_clock_.Now() - absl::Seconds(1));
}

TEST_F(MapRobotsTest, IgnoresOlderReportsOfARobotThatIsOnline) {
  Report("a", 1);
  RobotReport older = ReportOf("a", 2);
  older.stamp -= absl::Nanoseconds(1);
  EXPECT_FALSE(*robots_.Report(older));
  EXPECT_EQ(robots_.List()[0].report.frame_from_robot.x(), 1);
  // A report that is ignored does not keep the robot online, so that a robot whose clock was set
  // back is heard again.
  clock_.Advance(absl::Seconds(10));
  EXPECT_THAT(Names(robots_.List()), ElementsAre("-a"));
  EXPECT_TRUE(*robots_.Report(older));
  EXPECT_THAT(Names(robots_.List()), ElementsAre("+a"));
}

TEST_F(MapRobotsTest, RobotsGoOfflineAndAreForgotten) {
  Report("a");
  clock_.Advance(absl::Seconds(9));
  EXPECT_EQ(robots_.UntilChange(), absl::Seconds(1));
  EXPECT_THAT(Names(robots_.List()), ElementsAre("+a"));
  clock_.Advance(absl::Seconds(1));
  EXPECT_THAT(Names(robots_.List()), ElementsAre("-a"));
  EXPECT_EQ(robots_.count().offline, 1u);
  EXPECT_EQ(robots_.UntilChange(), absl::Seconds(50));
  clock_.Advance(absl::Seconds(50));
  EXPECT_THAT(robots_.List(), IsEmpty());
  EXPECT_EQ(robots_.UntilChange(), absl::InfiniteDuration());
}

TEST_F(MapRobotsTest, JumpsOfTheWallClockMakeNobodyOffline) {
  Report("a");
  clock_.Jump(absl::Hours(10));
  EXPECT_THAT(Names(robots_.List()), ElementsAre("+a"));
}

TEST_F(MapRobotsTest, AnOfflineRobotGivesWayToANewOne) {
  Report("a");
  clock_.Advance(absl::Seconds(1));
  Report("b");
  Report("c");
  const absl::StatusOr<bool> refused = robots_.Report(ReportOf("d"));
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status()));
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("--max_robots is 3"));
  Report("b");
  clock_.Advance(absl::Seconds(9));
  Report("d");
  EXPECT_THAT(Names(robots_.List()), ElementsAre("+b", "+c", "+d"));
}

TEST_F(MapRobotsTest, AReaderGetsAllRobotsAndThenChanges) {
  Report("a");
  Report("b");
  MapRobots::Changes changes = ReadAfter(0);
  EXPECT_TRUE(changes.reset);
  EXPECT_THAT(Names(changes.robots), ElementsAre("+a", "+b"));
  changes = ReadAfter(changes.number);
  EXPECT_FALSE(changes.reset);
  EXPECT_THAT(changes.robots, IsEmpty());
  for (int i = 0; i < 5; ++i) Report("a", i);
  changes = ReadAfter(changes.number);
  EXPECT_THAT(Names(changes.robots), ElementsAre("+a"));
  EXPECT_EQ(changes.robots[0].report.frame_from_robot.x(), 4);
  clock_.Advance(absl::Seconds(10));
  changes = ReadAfter(changes.number);
  EXPECT_THAT(Names(changes.robots), UnorderedElementsAre("-a", "-b"));
  clock_.Advance(absl::Seconds(50));
  changes = ReadAfter(changes.number);
  EXPECT_THAT(changes.robots, IsEmpty());
  EXPECT_THAT(changes.forgotten, UnorderedElementsAre("a", "b"));
}

TEST_F(MapRobotsTest, AReaderOfAnEmptyMapIsNotResetAgain) {
  const MapRobots::Changes nothing = ReadAfter(0);
  EXPECT_TRUE(nothing.reset);
  Report("a");
  const MapRobots::Changes changes = ReadAfter(nothing.number);
  EXPECT_FALSE(changes.reset);
  EXPECT_THAT(Names(changes.robots), ElementsAre("+a"));
}

TEST_F(MapRobotsTest, PartsAreBoundedByItemsAndBytes) {
  Report("a");
  Report("b");
  Report("c");
  MapRobots::Changes changes = robots_.ReadAfter(0, 2, kManyBytes);
  EXPECT_TRUE(changes.more);
  EXPECT_THAT(Names(changes.robots), ElementsAre("+a", "+b"));
  // What changes meanwhile is told with the rest.
  Report("a", 1);
  changes = robots_.ReadAfter(changes.number, 2, kManyBytes);
  EXPECT_FALSE(changes.more);
  EXPECT_THAT(Names(changes.robots), ElementsAre("+c", "+a"));
  changes = robots_.ReadAfter(0, kManyItems, 1);
  EXPECT_TRUE(changes.more);
  EXPECT_THAT(Names(changes.robots), ElementsAre("+b"));
}

TEST_F(MapRobotsTest, AReaderWhoMissedForgottenRobotsBeginsAnew) {
  Report("a");
  const MapRobots::ChangeNumber known = ReadAfter(0).number;
  // Four are forgotten, of which three are remembered.
  for (const std::string robot : {"a", "b", "c", "d"}) {
    Report(robot);
    clock_.Advance(absl::Seconds(60));
  }
  Report("e");
  const MapRobots::Changes changes = ReadAfter(known);
  EXPECT_TRUE(changes.reset);
  EXPECT_THAT(Names(changes.robots), ElementsAre("+e"));
}

TEST_F(MapRobotsTest, ARobotThatComesBackIsNotForgotten) {
  Report("a");
  const MapRobots::ChangeNumber known = ReadAfter(0).number;
  clock_.Advance(absl::Seconds(60));
  Report("a", 5);
  const MapRobots::Changes changes = ReadAfter(known);
  EXPECT_THAT(changes.forgotten, IsEmpty());
  EXPECT_THAT(Names(changes.robots), ElementsAre("+a"));
}

TEST_F(MapRobotsTest, WaitsEndWithTheNextChange) {
  int calls = 0;
  const auto count = [&calls] { ++calls; };
  robots_.Await(ReadAfter(0).number, count);
  const MapRobots::WaitId dropped = robots_.Await(ReadAfter(0).number, count);
  robots_.Remove(dropped);
  EXPECT_EQ(calls, 0);
  Report("a");
  EXPECT_EQ(calls, 1);
  Report("a");
  EXPECT_EQ(calls, 1);
  // Not up to date: there is nothing to wait for.
  robots_.Await(1, count);
  EXPECT_EQ(calls, 2);
  // Time is noticed by whoever looks next.
  robots_.Await(ReadAfter(1).number, count);
  clock_.Advance(absl::Seconds(10));
  robots_.List();
  EXPECT_EQ(calls, 3);
}

// Readers who carry out the changes that they get, each at its own pace, know what List tells.
TEST_F(MapRobotsTest, ReadersOfAnyPaceArriveAtTheSameState) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  const auto pick = [&random](int end) {
    return std::uniform_int_distribution<int>(0, end - 1)(random);
  };
  struct Reader {
    MapRobots::ChangeNumber number = 0;
    std::map<std::string, RobotPresence> robots;
  };
  std::vector<Reader> readers(4);
  const auto read = [&](Reader& reader) {
    const MapRobots::Changes changes = robots_.ReadAfter(reader.number, 1 + pick(3), kManyBytes);
    if (changes.reset) reader.robots.clear();
    for (const std::string& name : changes.forgotten) reader.robots.erase(name);
    for (const RobotPresence& robot : changes.robots) reader.robots[robot.report.robot] = robot;
    reader.number = changes.number;
    return changes.more;
  };
  for (int step = 0; step < 20'000; ++step) {
    if (pick(3) == 0) clock_.Advance(absl::Seconds(pick(20)));
    (void)robots_.Report(ReportOf("r" + std::to_string(pick(8)), step));
    // The first reads often, the last hardly ever.
    for (int i = 0; i < 4; ++i) {
      if (pick(1 << (2 * i)) == 0) read(readers[i]);
    }
    if (step % 100 != 0) continue;
    for (Reader& reader : readers) {
      while (read(reader)) {
      }
      std::vector<RobotPresence> known;
      for (const auto& [name, robot] : reader.robots) known.push_back(robot);
      ASSERT_EQ(known, robots_.List()) << "after step " << step;
    }
  }
}

}  // namespace
}  // namespace hypermap::server
