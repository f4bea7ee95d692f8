#include "simulation/robots/expedition.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "simulation/robots/testing/drawn_site.h"
#include "simulation/robots/testing/robot_site.h"

namespace hypermap::robots {
namespace {

using ::testing::ElementsAre;
using ::testing::Ge;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr int64_t kRoomCells = 30;

// A room that is too large to be seen from one place.
const std::vector<std::string> kRoomAndCloset = {"################",  //
                                                 "#..........##..#",  //
                                                 "#..........##..#",  //
                                                 "#..........##..#",  //
                                                 "################"};
constexpr Point kInRoom{0.75, 1.25}, kInCloset{6.75, 1.25};

ExpeditionOptions Options(const std::vector<Point>& starts = {kInRoom}) {
  ExpeditionOptions options;
  options.map = "site";
  options.area = Polygon::FromBox({{0, 0}, {100, 100}});
  options.starts = starts;
  options.robots = std::max(1, static_cast<int>(starts.size()));
  options.robot_radius_m = 0.0;
  options.range_m = 2.0;
  options.min_gain_cells = 1;
  options.frame_every = 6;
  return options;
}

std::vector<Point> WayOf(const absl::StatusOr<ExpeditionReport>& report, size_t robot) {
  EXPECT_TRUE(report.ok()) << report.status();
  return report.ok() ? report->robots[robot].way : std::vector<Point>();
}

// A site, and actions on it between the steps of an expedition.
class Journey {
 public:
  explicit Journey(const std::vector<std::string>& lines,
                   absl::Duration delay = absl::ZeroDuration())
      : site_(lines, kResolution_m, delay) {}

  RobotSite& site() { return site_; }
  client::Client& client() { return client_; }

  // Called before each step, with the number of earlier steps. Returns true to interrupt.
  std::function<bool(int)> between_steps = [](int) { return false; };
  TellProgress tell_progress;

  absl::StatusOr<ExpeditionReport> Explore(const ExpeditionOptions& options) {
    int steps = 0;
    return robots::Explore(
        client_, options, [&] { return between_steps(steps++); }, tell_progress);
  }

  // Returns the newest exploration of the server.
  client::ExplorationEntry Exploration() {
    const auto answer = client_.GetExploration("site");
    EXPECT_TRUE(answer.ok()) << answer.status();
    return answer.ok() ? answer->entry : client::ExplorationEntry();
  }

 private:
  RobotSite site_;
  client::Client client_ = site_.NewClient();
};

TEST(ExpeditionTest, ARobotExploresAllThatThereIs) {
  Journey journey(kRoom);
  const auto report = journey.Explore(Options());
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->end_reason, EndReason::kDone);
  EXPECT_GT(report->steps, 0);
  EXPECT_EQ(report->floor.explored, kRoomCells);
  EXPECT_EQ(report->floor.missed, 0);
  EXPECT_EQ(report->floor.hidden, 0);
  EXPECT_EQ(report->server_progress.cells.explored, kRoomCells);
  EXPECT_EQ(report->conflicts, 0);
  EXPECT_EQ(report->num_objects, 0);
  EXPECT_THAT(report->robot_names, ElementsAre("robot-1"));
  ASSERT_THAT(report->robots, SizeIs(1));
  const RobotLog& log = report->robots[0];
  EXPECT_EQ(log.way.front(), kInRoom);
  EXPECT_GE(log.goals, 2);
  EXPECT_EQ(log.lost + log.unreachable, 0);
  EXPECT_THAT(journey.site().SequencesIn("semantic_explored", "robot-1"), SizeIs(log.frames));
  EXPECT_EQ(journey.Exploration().exploration.id, report->exploration_id);
  EXPECT_EQ(journey.site().snapshot()->revision, report->revision);
}

TEST(ExpeditionTest, TheSameSeedMakesTheSameStepsHoweverSlowTheServerIs) {
  ExpeditionOptions options = Options({});
  options.robots = 2;
  options.noisy_detector = true;
  options.pose_error = true;
  const auto a = Journey(kRoom).Explore(options);
  const auto b = Journey(kRoom, absl::Milliseconds(5)).Explore(options);
  ASSERT_TRUE(a.ok() && b.ok()) << a.status() << b.status();
  EXPECT_EQ(a->steps, b->steps);
  EXPECT_EQ(a->conflicts, b->conflicts);
  EXPECT_EQ(a->floor.explored, b->floor.explored);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(a->robots[i].way, b->robots[i].way);
    EXPECT_EQ(a->robots[i].frames, b->robots[i].frames);
    EXPECT_EQ(a->robots[i].driven_m, b->robots[i].driven_m);
  }
  options.seed = 2;
  EXPECT_NE(WayOf(Journey(kRoom).Explore(options), 0), a->robots[0].way);
}

TEST(ExpeditionTest, TheFirstSetsOutFromTheSamePlaceHoweverManyComeAlong) {
  ExpeditionOptions options = Options({});
  const auto alone = Journey(kRoom).Explore(options);
  options.robots = 3;
  const auto together = Journey(kRoom).Explore(options);
  ASSERT_TRUE(alone.ok() && together.ok()) << alone.status() << together.status();
  EXPECT_THAT(together->robot_names, ElementsAre("robot-1", "robot-2", "robot-3"));
  EXPECT_EQ(together->robots[0].way.front(), alone->robots[0].way.front());
  EXPECT_EQ(together->floor.missed, 0);
  EXPECT_EQ(together->conflicts, 0);
}

TEST(ExpeditionTest, StepsAreCountedToTheEnd) {
  const auto report = Journey(kRoom).Explore(Options());
  ASSERT_TRUE(report.ok()) << report.status();
  ExpeditionOptions options = Options();
  options.max_steps = report->steps;
  const auto enough = Journey(kRoom).Explore(options);
  ASSERT_TRUE(enough.ok()) << enough.status();
  EXPECT_EQ(enough->steps, report->steps);
  Journey journey(kRoom);
  options.max_steps = report->steps - 1;
  EXPECT_EQ(journey.Explore(options).status(),
            absl::DeadlineExceededError(
                absl::StrCat("the exploration has not ended after ", report->steps - 1, " steps")));
}

TEST(ExpeditionTest, GoalsAreGivenBackWhenItIsInterrupted) {
  Journey journey(kRoomAndCloset);
  size_t goals = 0;
  journey.between_steps = [&](int steps) {
    if (steps == 3) goals = journey.Exploration().goals.size();
    return steps == 3;
  };
  EXPECT_EQ(journey.Explore(Options({kInRoom, kInCloset})).status(),
            absl::CancelledError("interrupted"));
  EXPECT_EQ(goals, 2u);
  const client::ExplorationEntry entry = journey.Exploration();
  EXPECT_THAT(entry.goals, IsEmpty());
  EXPECT_EQ(entry.exploration.state, ExplorationState::kActive) << "others may go on";
}

TEST(ExpeditionTest, OthersGiveTheirGoalsBackWhenOneFails) {
  Journey journey(kRoomAndCloset);
  bool held = false;
  journey.between_steps = [&](int steps) {
    // The robot in the closet is told that it is walled in when it next claims a goal.
    const CellBox closet{1, 4, 13, 15};
    if (steps == 1) {
      journey.site().Edit(
          WriteCells{"occupancy", closet, std::vector<std::optional<double>>(6, 1.0)});
    }
    for (const LeasedGoal& goal : journey.Exploration().goals) held |= goal.robot == "robot-1";
    return false;
  };
  const absl::Status status = journey.Explore(Options({kInRoom, kInCloset})).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("robot-2"));
  EXPECT_TRUE(held);
  EXPECT_THAT(journey.Exploration().goals, IsEmpty());
}

TEST(ExpeditionTest, ARobotThatIsShutInDoesNotKeepTheOthers) {
  Journey journey(kRoomAndCloset);
  const auto report = journey.Explore(Options({kInCloset, kInRoom}));
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->end_reason, EndReason::kDone);
  EXPECT_EQ(report->floor.explored, kRoomCells + 6);
  EXPECT_EQ(report->robots[0].goals, 1);
  EXPECT_GE(report->robots[1].goals, 2);
}

TEST(ExpeditionTest, WhatNoRobotCanGetToIsLeft) {
  const auto report = Journey(kRoomAndCloset).Explore(Options({kInRoom}));
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->end_reason, EndReason::kOnlyUnreachableLeft);
  EXPECT_EQ(report->floor.explored, kRoomCells);
  EXPECT_EQ(report->floor.missed, 0);
  EXPECT_EQ(report->floor.hidden, 6);
}

TEST(ExpeditionTest, EndsWhenSomebodyStopsTheExploration) {
  Journey journey(kRoom);
  journey.between_steps = [&](int steps) {
    if (steps == 5) {
      EXPECT_TRUE(journey.client().StopExploration("site").ok());
    }
    return false;
  };
  const auto report = journey.Explore(Options());
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->end_reason, EndReason::kStopped);
  EXPECT_GT(report->steps, 5);
  EXPECT_GT(report->floor.missed, 0);
}

TEST(ExpeditionTest, WaitsForWhatSomebodyElseHas) {
  Journey journey({"######", "#....#", "#....#", "######"});
  std::optional<LeasedGoal> others;
  journey.between_steps = [&](int steps) {
    if (steps == 0) {
      const auto claimed = journey.client().ClaimGoal("site", "other", {1.25, 0.75});
      EXPECT_TRUE(claimed.ok() && claimed->goal) << claimed.status();
      if (claimed.ok()) others = claimed->goal;
    }
    if (steps == 2 && others) {
      const auto released = journey.client().ReleaseGoal("site", "other", others->id,
                                                         client::GoalOutcome::kAbandoned);
      EXPECT_TRUE(released.ok()) << released.status();
    }
    return false;
  };
  const auto report = journey.Explore(Options());
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->end_reason, EndReason::kDone);
  EXPECT_EQ(report->robots[0].goals, 1);
}

TEST(ExpeditionTest, AServerThatIsStartedAgainHasEachFrameOnce) {
  Journey journey(kRoom);
  journey.between_steps = [&](int steps) {
    if (steps == 8 || steps == 40) {
      journey.site().Stop();
      journey.site().Start();
    }
    return false;
  };
  const auto report = journey.Explore(Options());
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_GT(report->steps, 40);
  EXPECT_EQ(report->end_reason, EndReason::kDone);
  EXPECT_EQ(report->floor.explored, kRoomCells);
  EXPECT_EQ(report->robots[0].lost, 0);
  const std::vector<int64_t> stored = journey.site().SequencesIn("semantic_explored", "robot-1");
  ASSERT_THAT(stored, SizeIs(report->robots[0].frames));
  for (size_t i = 0; i < stored.size(); ++i) EXPECT_EQ(stored[i], static_cast<int64_t>(i));
}

// The client requests a token for each call, which counts the calls.
TEST(ExpeditionTest, AServerThatIsGoneIsNotWaitedForByEachRobot) {
  Journey journey(kRoomAndCloset);
  int calls = 0;
  client::ClientOptions of_calls{.retry_for = absl::ZeroDuration()};
  of_calls.token = [&calls] {
    ++calls;
    return "token";
  };
  client::Client client(journey.site().address(), of_calls);
  ExpeditionOptions options = Options({kInRoom, kInCloset});
  options.patience = absl::ZeroDuration();
  int steps = 0;
  const auto stop = [&] {
    if (steps++ != 1) return false;
    EXPECT_THAT(journey.Exploration().goals, SizeIs(2));
    journey.site().Stop();
    calls = 0;
    return false;
  };
  const absl::Status status = Explore(client, options, stop, nullptr).status();
  EXPECT_TRUE(absl::IsUnavailable(status)) << status;
  EXPECT_EQ(calls, 2) << "a stream to go on with, and a goal to give back";
}

TEST(ExpeditionTest, TellsHowFarItIs) {
  Journey journey(kRoom);
  std::vector<ExpeditionProgress> told;
  journey.tell_progress = [&](const ExpeditionProgress& progress) { told.push_back(progress); };
  const auto report = journey.Explore(Options());
  ASSERT_TRUE(report.ok()) << report.status();
  ASSERT_THAT(told, SizeIs(report->steps / 25));
  ASSERT_THAT(told, SizeIs(Ge(2u)));
  for (size_t i = 0; i < told.size(); ++i) {
    EXPECT_EQ(told[i].steps, 25 * static_cast<int64_t>(i + 1));
    EXPECT_LE(told[i].goals, report->robots[0].goals);
    EXPECT_GE(told[i].fraction, i == 0 ? 0.0 : told[i - 1].fraction);
  }
  EXPECT_GT(told.back().fraction, 0.0);
}

TEST(ExpeditionTest, FindsWhatStandsThereAndTellsTheTruth) {
  Journey journey({"#########", "#.......#", "#.......#", "#.......#", "#########"});
  SemanticObject suitcase{.label = "suitcase", .shape = Polygon::FromBox({{2.5, 1.0}, {2.9, 1.5}})};
  journey.site().Edit(CreateLayer{{.name = "things"}});
  journey.site().Edit(PutObject{"things", suitcase});
  const auto report = journey.Explore(Options());
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->num_objects, 1);
  EXPECT_EQ(report->num_objects_seen, 1);
  EXPECT_THAT(report->truth, HasSubstr("suitcase"));
  const Layer* found = journey.site().snapshot()->FindLayer("semantic_explored");
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->Size(), 1);
  // Objects that were detected are not part of the world that the next robots explore.
  ExpeditionOptions again = Options();
  again.semantic_layer = "again";
  again.explored_layer = "explored_again";
  journey.between_steps = [&](int steps) {
    EXPECT_TRUE(steps > 0 || journey.client().StopExploration("site").ok());
    return false;
  };
  const auto second = journey.Explore(again);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->num_objects, 1);
}

TEST(ExpeditionTest, WhatCannotBeExploredIsRefusedAndChangesNothing) {
  Journey journey(kRoom);
  journey.site().Edit(CreateLayer{{.name = "things"}});
  const Revision before = journey.site().snapshot()->revision;
  using Code = absl::StatusCode;
  struct Case {
    std::function<void(ExpeditionOptions&)> change;
    Code code;
    std::string named;
  };
  const Case cases[] = {
      {[](auto& o) { o.map = "nowhere"; }, Code::kNotFound, "nowhere"},
      {[](auto& o) { o.occupancy_layer = "absent"; }, Code::kNotFound, "absent"},
      {[](auto& o) { o.occupancy_layer = "things"; }, Code::kFailedPrecondition, "things"},
      {[](auto& o) { o.object_layers = {"absent"}; }, Code::kNotFound, "absent"},
      {[](auto& o) { o.object_layers = {"occupancy"}; }, Code::kFailedPrecondition, "occupancy"},
      {[](auto& o) {
         o.starts = {{50, 50}};
       },
       Code::kInvalidArgument, "start: "},
      {[](auto& o) {
         o.starts.clear();
         o.area = Polygon::FromBox({{50, 50}, {60, 60}});
       },
       Code::kInvalidArgument, "area: "},
  };
  for (const Case& c : cases) {
    ExpeditionOptions options = Options();
    c.change(options);
    const absl::Status status = journey.Explore(options).status();
    EXPECT_EQ(status.code(), c.code) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(c.named));
  }
  EXPECT_EQ(journey.site().snapshot()->revision, before);
}

TEST(ExpeditionTest, AnExplorationThatNoRobotCanJoinIsStopped) {
  Journey journey(kRoom);
  ExpeditionOptions options = Options();
  options.semantic_layer = "occupancy";
  EXPECT_TRUE(absl::IsFailedPrecondition(journey.Explore(options).status()));
  EXPECT_EQ(journey.Exploration().exploration.end_reason, EndReason::kStopped);
}

}  // namespace
}  // namespace hypermap::robots
