#include "simulation/robots/robot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include "map/exploration/viewshed.h"
#include "simulation/robots/testing/drawn_site.h"
#include "simulation/robots/testing/robot_site.h"
#include "simulation/worlds/world_from_map.h"

namespace hypermap::robots {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kRange_m = 2.0;
// Distance per step: 0.4 m/s in five steps a second.
constexpr double kStride_m = 0.08;
// So short that it is renewed in each step: half of it has always passed.
constexpr absl::Duration kShortLease = absl::Microseconds(1);
constexpr CellIndex kStart{2, 1};

// A room that is too large to be seen from one place.
const std::vector<std::string> kWalledRoom = {"############",  //
                                              "#....#.....#",  //
                                              "#....#.....#",  //
                                              "#....#.....#",  //
                                              "############"};
// A room that can be seen as a whole from every place in it.
const std::vector<std::string> kCloset = {"######",  //
                                          "#....#",  //
                                          "#....#",  //
                                          "#....#",  //
                                          "######"};

// A robot in a world that may differ from the server's map.
class Life {
 public:
  Life(client::Client client, const std::vector<std::string>& world, Robot::Task task)
      : client_(std::move(client)), layer_(DrawnSite(world, kResolution_m)) {
    ObservationSender::Target target{"site", "things", {}};
    target.options = {.exploration_layer = "explored", .robot = task.name};
    robot_ = std::make_unique<Robot>(
        client_, terrain_, senses_,
        ObservationSender(client_, target, absl::Seconds(60), [] { return false; }),
        std::move(task), kStart);
    EXPECT_EQ(robot_->Open(), absl::OkStatus());
  }

  Robot& robot() { return *robot_; }
  const Terrain& terrain() const { return terrain_; }

  void StepUntil(const std::function<bool()>& condition) {
    constexpr int kMostSteps = 5000;
    for (int i = 0; i < kMostSteps && !condition(); ++i) {
      ASSERT_EQ(robot_->Step(), absl::OkStatus());
    }
    ASSERT_TRUE(condition()) << "not after " << kMostSteps << " steps";
  }

 private:
  client::Client client_;
  const std::shared_ptr<const GridLayer> layer_;
  const Terrain terrain_{*layer_, Polygon::FromBox({{0, 0}, {100, 100}}), 0.0};
  const World world_{simulation::WorldFromMap(terrain_.plan(), terrain_.geometry(), {}),
                     {terrain_.plan(), terrain_.geometry(), simulation::kWallHeight_m}};
  Senses senses_{world_, layer_, {.range_m = kRange_m}};
  std::unique_ptr<Robot> robot_;
};

class RobotTest : public ::testing::Test {
 protected:
  // Draws the server's map, and starts an exploration for robots of radius 0.
  void Begin(const std::vector<std::string>& lines) {
    site_.emplace(lines, kResolution_m);
    site_->Edit(CreateLayer{{.name = "things"}});
    client_.emplace(site_->NewClient());
    const auto started = client_->StartExploration("site", Polygon::FromBox({{0, 0}, {100, 100}}),
                                                   "occupancy", "explored",
                                                   {.robot_radius_m = 0.0,
                                                    .range_m = kRange_m,
                                                    .min_gain_cells = 1,
                                                    .explored_rule = CellRule::kTouched});
    ASSERT_TRUE(started.ok()) << started.status();
    exploration_id_ = started->entry.exploration.id;
  }

  Robot::Task NewTask() const {
    return {.map = "site",
            .exploration_id = exploration_id_,
            .name = "cart",
            .frame_id = "map",
            .frame_every = 6,
            .look_every = 3};
  }
  Life NewLife(const std::vector<std::string>& world, absl::Duration lease = absl::Minutes(1)) {
    Robot::Task task = NewTask();
    task.lease = lease;
    return {site_->NewClient(), world, task};
  }

  // Returns the server's state of the exploration.
  client::ExplorationAnswer Exploration() {
    const auto answer = client_->GetExploration("site", exploration_id_);
    EXPECT_TRUE(answer.ok()) << answer.status();
    return answer.value_or(client::ExplorationAnswer());
  }
  std::vector<LeasedGoal> Goals() { return Exploration().entry.goals; }
  void GiveBack(const LeasedGoal& goal) {
    const auto released =
        client_->ReleaseGoal("site", goal.robot, goal.id, client::GoalOutcome::kAbandoned);
    ASSERT_TRUE(released.ok()) << released.status();
  }
  std::vector<int64_t> Stored() { return site_->SequencesIn("things", "cart"); }

  std::optional<RobotSite> site_;
  std::optional<client::Client> client_;
  ObjectId exploration_id_ = 0;
};

TEST_F(RobotTest, DrivesToItsGoalLooksRoundAndGivesItBack) {
  Begin(kRoom);
  Life life = NewLife(kRoom);
  Robot& robot = life.robot();
  EXPECT_FALSE(robot.goal());
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  ASSERT_TRUE(robot.goal());
  const LeasedGoal goal = *robot.goal();
  ASSERT_THAT(Goals(), SizeIs(1));
  EXPECT_EQ(Goals()[0].id, goal.id);
  EXPECT_EQ(Goals()[0].robot, "cart");
  life.StepUntil([&] { return robot.log().goals == 1; });
  EXPECT_EQ(robot.log().way.back(), goal.position);
  EXPECT_FALSE(robot.goal());
  EXPECT_THAT(Goals(), IsEmpty());
  // All observations are stored by the time the goal is reported as reached.
  EXPECT_GE(robot.log().frames, 12) << "a frame for 30 degrees";
  EXPECT_THAT(Stored(), SizeIs(robot.log().frames));
  EXPECT_GT(Exploration().progress.cells.explored, 0);
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  ASSERT_TRUE(robot.goal());
  EXPECT_NE(robot.goal()->position, goal.position);
}

TEST_F(RobotTest, ReportsWhereItIsAndWhatItDoes) {
  Begin(kRoom);
  Life life = NewLife(kRoom);
  const auto reported = [&](const std::string& state) {
    const auto list = client_->ListRobots("site");
    EXPECT_TRUE(list.ok()) << list.status();
    return list->robots.size() == 1 && list->robots[0].report.state == state;
  };
  ASSERT_EQ(life.robot().Step(), absl::OkStatus());
  EXPECT_TRUE(reported("waiting for a goal"));
  const client::RobotPresence robot = client_->ListRobots("site")->robots[0];
  EXPECT_EQ(robot.report.robot, "cart");
  EXPECT_TRUE(robot.in_map_frame);
  const Point start = life.robot().log().way.front();
  EXPECT_EQ(robot.report.frame_from_robot, PlanarTransform(start.x, start.y, 0.0));
  // It reports in real time, and steps as fast as it can.
  life.StepUntil([&] { return reported("driving to a goal") || reported("looking around"); });
}

TEST_F(RobotTest, ExploresUntilItIsToldThatAllIsDone) {
  Begin(kRoom);
  Life life = NewLife(kRoom);
  Robot& robot = life.robot();
  while (!robot.has_ended()) {
    const double before_m = robot.log().driven_m;
    ASSERT_EQ(robot.Step(), absl::OkStatus());
    ASSERT_LE(robot.log().driven_m - before_m, kStride_m + 1e-9);
    ASSERT_LT(robot.log().goals, 30) << "it does not end";
  }
  EXPECT_EQ(robot.end_reason(), EndReason::kDone);
  EXPECT_GE(robot.log().goals, 2);
  EXPECT_EQ(robot.log().unreachable, 0);
  EXPECT_EQ(robot.log().lost, 0);
  EXPECT_EQ(Exploration().entry.exploration.end_reason, EndReason::kDone);
  EXPECT_EQ(Exploration().progress.cells.reachable, 0);
  EXPECT_THAT(Stored(), SizeIs(robot.log().frames));
}

TEST_F(RobotTest, ItsWayLeadsOverFloorThatIsPassable) {
  const std::vector<std::string> room = {"############",  //
                                         "#.....#....#",  //
                                         "#..#..#..#.#",  //
                                         "#..#.....#.#",  //
                                         "############"};
  Begin(room);
  Life life = NewLife(room);
  Robot& robot = life.robot();
  life.StepUntil([&] { return robot.has_ended(); });
  const std::vector<Point>& way = robot.log().way;
  double length_m = 0.0;
  for (size_t i = 1; i < way.size(); ++i) {
    const auto from = life.terrain().geometry().CellAt(way[i - 1]);
    const auto to = life.terrain().geometry().CellAt(way[i]);
    ASSERT_TRUE(from && to);
    EXPECT_TRUE(HasLineOfSight(life.terrain().passable(), *from, *to))
        << way[i].x << ", " << way[i].y;
    length_m += std::hypot(way[i].x - way[i - 1].x, way[i].y - way[i - 1].y);
  }
  EXPECT_GT(length_m, 5.0);
  EXPECT_NEAR(robot.log().driven_m, length_m, 1e-6);
}

TEST_F(RobotTest, WaitsAndAsksAgainWhileOthersHaveAllThatIsLeft) {
  Begin(kCloset);
  const auto others = client_->ClaimGoal("site", "other", {1.25, 1.25});
  ASSERT_TRUE(others.ok() && others->goal) << others.status();
  Life life = NewLife(kCloset);
  Robot& robot = life.robot();
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  EXPECT_TRUE(robot.is_waiting());
  EXPECT_FALSE(robot.has_ended());
  GiveBack(*others->goal);
  for (int i = 0; i < 5; ++i) {
    EXPECT_FALSE(robot.goal()) << "it asks every six steps";
    ASSERT_EQ(robot.Step(), absl::OkStatus());
  }
  EXPECT_EQ(robot.log().frames, 0);
  EXPECT_THAT(robot.log().way, SizeIs(1));
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  EXPECT_TRUE(robot.goal());
  EXPECT_FALSE(robot.is_waiting());
}

TEST_F(RobotTest, GivesUpWhatItCannotGetTo) {
  Begin(kRoom);
  Life life = NewLife(kWalledRoom);
  Robot& robot = life.robot();
  life.StepUntil([&] { return robot.has_ended(); });
  EXPECT_EQ(robot.end_reason(), EndReason::kOnlyUnreachableLeft);
  EXPECT_GE(robot.log().goals, 1);
  EXPECT_GE(robot.log().unreachable, 1);
  const client::ExplorationEntry entry = Exploration().entry;
  ASSERT_THAT(entry.unreachable_places, SizeIs(robot.log().unreachable));
  for (const client::GivenUpPlace& place : entry.unreachable_places) {
    EXPECT_EQ(place.robot, "cart");
    EXPECT_GT(place.position.x, 5 * kResolution_m) << "behind the wall";
  }
  for (const Point& p : robot.log().way) EXPECT_LT(p.x, 5 * kResolution_m);
}

TEST_F(RobotTest, AwaitsOthersBeforeItAsksAndBeforeItTells) {
  Begin(kRoom);
  std::vector<size_t> goals;
  Robot::Task task = NewTask();
  task.await_others = [&] {
    goals.push_back(Goals().size());
    return goals.size() < 3 ? absl::OkStatus() : absl::AbortedError("enough");
  };
  Life life(site_->NewClient(), kRoom, task);
  life.StepUntil([&] { return life.robot().log().goals == 1; });
  EXPECT_THAT(goals, ElementsAre(0, 1));
  EXPECT_EQ(life.robot().Step(), absl::AbortedError("enough"));
  EXPECT_THAT(Goals(), IsEmpty()) << "it did not ask";
}

TEST_F(RobotTest, KeepsItsLeaseAsLongAsItNeedsTheGoal) {
  Begin(kRoom);
  Life life = NewLife(kRoom, kShortLease);
  Robot& robot = life.robot();
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  ASSERT_TRUE(robot.goal());
  const ObjectId id = robot.goal()->id;
  for (int i = 0; i < 20; ++i) {
    site_->Advance(0.6 * kShortLease);
    ASSERT_EQ(robot.Step(), absl::OkStatus());
    const std::vector<LeasedGoal> goals = Goals();
    ASSERT_THAT(goals, SizeIs(1));
    EXPECT_EQ(goals[0].id, id);
    EXPECT_EQ(goals[0].expires_at, site_->Now() + kShortLease);
  }
  EXPECT_EQ(robot.log().lost, 0);
}

TEST_F(RobotTest, AsksForAnotherGoalWhenItsLeaseHasEnded) {
  Begin(kRoom);
  Life life = NewLife(kRoom, kShortLease);
  Robot& robot = life.robot();
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  ASSERT_TRUE(robot.goal());
  const ObjectId lost = robot.goal()->id;
  site_->Advance(absl::Minutes(1));
  const absl::Time end = absl::Now() + absl::Seconds(60);
  while (!Goals().empty() && absl::Now() < end) absl::SleepFor(absl::Milliseconds(1));
  ASSERT_THAT(Goals(), IsEmpty());
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  EXPECT_EQ(robot.log().lost, 1);
  ASSERT_TRUE(robot.goal());
  EXPECT_NE(robot.goal()->id, lost);
  life.StepUntil([&] { return robot.has_ended(); });
  EXPECT_EQ(robot.end_reason(), EndReason::kDone);
  EXPECT_EQ(robot.log().lost, 1);
}

TEST_F(RobotTest, AGoalThatIsLostBeforeItIsGivenBackIsNoError) {
  Begin(kRoom);
  Life life = NewLife(kRoom);
  Robot& robot = life.robot();
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  ASSERT_TRUE(robot.goal());
  GiveBack(*robot.goal());
  life.StepUntil([&] { return robot.log().goals == 1; });
  EXPECT_EQ(robot.log().lost, 0) << "it did not have to ask";
  EXPECT_THAT(Stored(), SizeIs(robot.log().frames));
}

TEST_F(RobotTest, LearnsThatTheExplorationWasStopped) {
  Begin(kRoom);
  Life life = NewLife(kRoom, kShortLease);
  Robot& robot = life.robot();
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  ASSERT_TRUE(robot.goal());
  ASSERT_TRUE(client_->StopExploration("site", exploration_id_).ok());
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  EXPECT_TRUE(robot.has_ended());
  EXPECT_EQ(robot.end_reason(), EndReason::kStopped);
  EXPECT_FALSE(robot.goal());
  EXPECT_FALSE(robot.is_waiting());
}

TEST_F(RobotTest, AnAbandonedGoalIsFreeForOthers) {
  Begin(kRoom);
  Life life = NewLife(kRoom);
  Robot& robot = life.robot();
  EXPECT_EQ(robot.Abandon(), absl::OkStatus()) << "it has none";
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  ASSERT_THAT(Goals(), SizeIs(1));
  EXPECT_EQ(robot.Abandon(), absl::OkStatus());
  EXPECT_FALSE(robot.goal());
  const client::ExplorationEntry entry = Exploration().entry;
  EXPECT_THAT(entry.goals, IsEmpty());
  EXPECT_THAT(entry.unreachable_places, IsEmpty());
  EXPECT_EQ(robot.log().goals, 0);
}

// The robot learns of the obstacle from the server when it claims a goal.
TEST_F(RobotTest, ARobotThatIsWalledInIsTold) {
  Begin(kRoom);
  const CellBox around{1, 4, 1, 4};
  site_->Edit(WriteCells{"occupancy", around, std::vector<std::optional<double>>(9, 1.0)});
  Life life = NewLife(kRoom);
  Robot& robot = life.robot();
  const absl::Status status = robot.Step();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("stands where it cannot go"));
  EXPECT_FALSE(robot.goal());
  EXPECT_FALSE(robot.has_ended());
  site_->Edit(WriteCells{"occupancy", around, std::vector<std::optional<double>>(9, 0.0)});
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  EXPECT_TRUE(robot.goal());
}

TEST_F(RobotTest, FramesThatNoLayerTakesAreAnError) {
  Begin(kRoom);
  Life life = NewLife(kRoom);
  Robot& robot = life.robot();
  ASSERT_EQ(robot.Step(), absl::OkStatus());
  site_->Edit(DeleteLayer{"things"});
  absl::Status status;
  while (status.ok() && robot.log().goals == 0) status = robot.Step();
  EXPECT_TRUE(absl::IsNotFound(status)) << status;
  EXPECT_EQ(robot.log().goals, 0) << "who sees nothing has reached nothing";
}

}  // namespace
}  // namespace hypermap::robots
