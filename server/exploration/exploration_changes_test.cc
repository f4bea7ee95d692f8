// Explorations after changes of the map, edits of their objects, and restarts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/cancellation/testing/cancelled_after.h"
#include "server/exploration/exploration_follower.h"
#include "server/exploration/exploration_team.h"
#include "server/exploration/testing/exploration_site.h"
#include "tests/support/random_map.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Rng;
using ::testing::SizeIs;
using testing::TestSeed;
using testing::UniformInt;

class ExplorationChangesTest : public ::testing::Test, public ExplorationSite {
 protected:
  // Starts an exploration of a map of one room.
  void StartInARoom() {
    Draw(std::vector<std::string>(8, std::string(8, '.')));
    ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  }
  ObjectId ExplorationId() { return Newest().exploration.id; }
  void DeleteByHand(ObjectId id) { Submit({{DeleteObject{"explorations", id, {}}}}); }
  // Edits an object of the layer "explorations", as an operator may.
  template <typename Change>
  void EditByHand(ObjectId id, Change change) {
    const SnapshotPtr now = snapshot();
    const auto* layer = now->FindSemantic("explorations");
    SemanticObject object = *layer->Find(id);
    change(object);
    Submit({{PutObject{"explorations", std::move(object), ""}}});
  }
};

void ExpectSame(const Explorer::Progress& a, const Explorer::Progress& b) {
  EXPECT_EQ(a.explored, b.explored);
  EXPECT_EQ(a.reachable, b.reachable);
  EXPECT_EQ(a.unreachable, b.unreachable);
}

// Tests of unreachable places.

TEST_F(ExplorationChangesTest, NobodyIsSentToAPlaceGivenUpNorBesideIt) {
  StartInARoom();
  const auto first = Claim("r1", {0.25, 0.25});
  ASSERT_TRUE(first.goal.has_value());
  Release("r1", GoalOutcome::kUnreachable);
  ASSERT_THAT(Newest().unreachable_places, SizeIs(1));
  EXPECT_EQ(Newest().unreachable_places.front().cell, first.goal->cell);
  EXPECT_EQ(Newest().unreachable_places.front().robot, "r1");
  EXPECT_THAT(Goals(), IsEmpty());
  const auto second = Claim("r2", {0.25, 0.25});
  ASSERT_TRUE(second.goal.has_value());
  const Point a = Centroid(first.goal->cell);
  const Point b = Centroid(second.goal->cell);
  EXPECT_GT(std::hypot(a.x - b.x, a.y - b.y), 0.5);
}

TEST_F(ExplorationChangesTest, PlacesGivenUpEndItAsUnreachable) {
  Draw({"..."});
  ASSERT_TRUE(explorations()
                  .Start([this] {
                    ExplorationStart request = WholeArea();
                    request.min_gain_cells = 1;
                    return request;
                  }())
                  .ok());
  ClaimAnswer answer = Claim("r1", {0.25, 0.25});
  for (int i = 0; i < 3 && answer.goal; ++i) {
    Release("r1", GoalOutcome::kUnreachable);
    answer = Claim("r1", {0.25, 0.25});
  }
  EXPECT_EQ(answer.end_reason, EndReason::kOnlyUnreachableLeft);
}

TEST_F(ExplorationChangesTest, APlaceComesBackWhenFloorNearbyChanges) {
  Draw({std::string(66, '.')});
  ExplorationStart request = WholeArea();
  request.range_m = 2.0;
  ASSERT_TRUE(explorations().Start(request).ok());
  const auto given_up = Claim("r1", {0.25, 0.25});
  ASSERT_TRUE(given_up.goal.has_value());
  Release("r1", GoalOutcome::kUnreachable);
  Claim("r1", {0.25, 0.25});
  EXPECT_THAT(Newest().unreachable_places, SizeIs(1));
  // Changes beyond the robot's range, and cells that stay free, make no difference.
  const auto col = static_cast<int32_t>(Centroid(given_up.goal->cell).x / kResolution_m);
  Write({0, 1, col + 5, col + 7}, 1.0);
  Write({0, 1, 0, 4}, 0.1);
  Claim("r1", {0.25, 0.25});
  EXPECT_THAT(Newest().unreachable_places, SizeIs(1));
  Write({0, 1, col + 4, col + 5}, 1.0);
  const Revision before = snapshot()->revision;
  Claim("r1", {0.25, 0.25});
  EXPECT_THAT(Newest().unreachable_places, IsEmpty());
  EXPECT_EQ(snapshot()->revision, before + 1);
}

TEST_F(ExplorationChangesTest, AfterARestartAPlaceComesBackIfTheFloorChangedAnywhere) {
  Draw({std::string(66, '.')});
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  ASSERT_TRUE(Claim("r1", {0.25, 0.25}).goal.has_value());
  Release("r1", GoalOutcome::kUnreachable);
  Reopen();
  Claim("r1", {0.25, 0.25});
  EXPECT_THAT(Newest().unreachable_places, SizeIs(1));
  Write({0, 1, 60, 62}, 1.0);
  Reopen();
  Claim("r1", {0.25, 0.25});
  EXPECT_THAT(Newest().unreachable_places, IsEmpty());
}

TEST_F(ExplorationChangesTest, AClaimRemovesSomeOfManyPlacesAndLaterOnesTheRest) {
  StartInARoom();
  const UnreachablePlace place{0, ExplorationId(), "r1", Rectangle(1, 1, 1.5, 1.5), 0};
  EditBatch batch;
  for (int i = 0; i < 1'500; ++i) {
    batch.edits.push_back(PutObject{"explorations", ToObject(place), ""});
  }
  Submit(std::move(batch));
  ASSERT_THAT(Newest().unreachable_places, SizeIs(1'500));
  EXPECT_EQ(Claim("r1", {0.25, 0.25}).num_edits, 1'000);
  EXPECT_FALSE(Newest().unreachable_places.empty());
  Claim("r1", {0.25, 0.25});
  EXPECT_THAT(Newest().unreachable_places, IsEmpty());
}

TEST_F(ExplorationChangesTest, A4_ASearchLooksAtEachPlaceWhetherItIsGivenUp) {
  StartInARoom();
  ExplorationObjects objects = Newest();
  const UnreachablePlace far{1, ExplorationId(), "r1", Rectangle(90, 90, 91, 91), 1'000'000};
  objects.unreachable_places.assign(5'000, far);
  ExplorationFollower follower(room());
  ASSERT_TRUE(follower.Follow(*snapshot(), objects).ok());
  ExplorationTeam team;
  ASSERT_TRUE(team.Meet("r1", {0.25, 0.25}, Now(), &follower));
  const CancelledAfter never(1'000'000);
  EXPECT_TRUE(team.Choose("r1", objects, &follower).has_value());
  EXPECT_GE(never.num_looks(), 5'000);
}

// Tests of restarts.

TEST_F(ExplorationChangesTest, ARestartLosesNeitherClaimsNorWhatWasExplored) {
  StartInARoom();
  MarkExplored({0, 2, 0, 8});
  const auto claimed = Claim("r1", {0.25, 0.25});
  ASSERT_TRUE(claimed.goal.has_value());
  const ExplorationObjects before = Newest();
  const Explorer::Progress progress = Progress();
  Reopen();
  EXPECT_EQ(Newest().exploration, before.exploration);
  EXPECT_EQ(Newest().goals, before.goals);
  ExpectSame(Progress(), progress);
  // The robot keeps its goal, and no other robot is sent there.
  const auto other = Claim("r2", {0.25, 0.25});
  EXPECT_TRUE(!other.goal || other.goal->cell != claimed.goal->cell);
  EXPECT_TRUE(explorations().Renew({"r1", claimed.goal->id, absl::Minutes(1), "test"}).ok());
  LookRound(Centroid(claimed.goal->cell), 4.0);
  Release("r1", GoalOutcome::kReached);
  Reopen();
  Explore({{"r1", {0.25, 0.25}}, {"r2", {3.75, 3.75}}}, 4.0);
  EXPECT_EQ(Newest().exploration.end_reason, EndReason::kDone);
  Reopen();
  EXPECT_EQ(Newest().exploration.end_reason, EndReason::kDone);
  EXPECT_EQ(Progress().explored, 64);
}

TEST_F(ExplorationChangesTest, FollowsAsOneThatBeginsAnew) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  Draw(std::vector<std::string>(140, std::string(140, '.')));
  ExplorationStart request = WholeArea();
  // Floor by which the map grows is part of the exploration.
  request.area = Rectangle(-30, -30, 100, 100);
  request.range_m = 2.0;
  ASSERT_TRUE(explorations().Start(request).ok());
  for (int i = 0; i < 30; ++i) {
    const int row = UniformInt(rng, i == 20 ? -60 : 0, 130);
    const int col = UniformInt(rng, 0, i == 25 ? 190 : 130);
    const CellBox box{row, row + UniformInt(rng, 1, 20), col, col + UniformInt(rng, 1, 20)};
    if (UniformInt(rng, 0, 1) == 0) {
      Write(box, UniformInt(rng, 0, 2) / 2.0);
    } else {
      Write(box, UniformInt(rng, 0, 3) == 0 ? 0.0 : 1.0, "seen");
    }
    const Explorer::Progress followed = Progress();
    MapExplorations fresh(&session(), room());
    ExpectSame(followed, fresh.Get(0, "")->progress.cells);
  }
}

TEST_F(ExplorationChangesTest, AnUpdateThatIsGivenUpIsGoneOnWith) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  const int side = 3 * kTileSide;
  Draw(std::vector<std::string>(side, std::string(side, '.')));
  ExplorationStart request = WholeArea();
  request.area = Rectangle(0, 0, side * kResolution_m, side * kResolution_m);
  request.range_m = 2.0;
  ASSERT_TRUE(explorations().Start(request).ok());
  const ExplorationObjects objects = Newest();
  ExplorationFollower follower(room());
  ASSERT_TRUE(follower.Follow(*snapshot(), objects).ok());
  const int generation = follower.generation();
  int given_up = 0;
  for (int i = 0; i < 60; ++i) {
    // Between the calls that are given up, cells may change again, and back.
    const int row = UniformInt(rng, 0, side - 150);
    const int col = UniformInt(rng, 0, side - 150);
    const CellBox box{row, row + UniformInt(rng, 1, 150), col, col + UniformInt(rng, 1, 150)};
    Write(box, UniformInt(rng, 0, 1), UniformInt(rng, 0, 2) == 0 ? "walls" : "seen");
    {
      const CancelledAfter cancelled(UniformInt(rng, 0, 100));
      given_up += !follower.Follow(*snapshot(), objects).ok();
    }
    if (i % 4 != 3) continue;
    ASSERT_TRUE(follower.Follow(*snapshot(), objects).ok());
    MapExplorations fresh(&session(), room());
    ExpectSame(follower.explorer().progress(), fresh.Get(0, "")->progress.cells);
    EXPECT_EQ(follower.explorer().ListFrontiers().size(),
              fresh.ListFrontiers(0, "")->frontiers.size());
  }
  EXPECT_GT(given_up, 10) << given_up;
  EXPECT_EQ(follower.generation(), generation);
}

TEST_F(ExplorationChangesTest, A4_AChangeOfMuchFloorIsGivenUpAndFollowedLater) {
  DrawFree("fine", 0.05, 300);
  ExplorationStart request = WholeArea();
  request.area = Rectangle(0, 0, 15, 15);
  request.occupancy_layer = "fine";
  request.robot_radius_m = 2.5;
  ASSERT_TRUE(explorations().Start(request).ok());
  const ExplorationObjects objects = Newest();
  ExplorationFollower follower(room());
  const auto follow = [&] { return follower.Follow(*snapshot(), objects); };
  ASSERT_TRUE(follow().ok());
  const int generation = follower.generation();
  Write({0, 10, 0, 10}, 1.0, "fine");
  ASSERT_TRUE(follow().ok());
  EXPECT_EQ(follower.generation(), generation) << "a small change is no reason for a new Explorer";
  Write({100, 300, 0, 300}, 1.0, "fine");
  EXPECT_GT(TimesCancelled(follow), 10);
  ExpectSame(follower.explorer().progress(), Progress());
}

// Tests of layers.

TEST_F(ExplorationChangesTest, TheExplorationLayerMayHaveCellsAndAFrameOfItsOwn) {
  Draw(std::vector<std::string>(8, std::string(8, '.')));
  LayerSpec seen;
  seen.name = "seen";
  seen.kind = LayerKind::kExploration;
  seen.frame_id = "turned";
  seen.grid = GridGeometry{PlanarTransform(0.03, -0.02, 0.2), 0.3};
  const PlanarTransform map_from_turned(1.0, -2.0, 0.7);
  Submit({{SetTransform{{"map", "turned", map_from_turned}}, CreateLayer{seen}}});
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  EXPECT_EQ(Progress().explored, 0);
  for (const Polygon& area : {Rectangle(0, 0, 1.7, 2.9), Rectangle(1, 1, 3.9, 1.4)}) {
    Submit({{FillPolygon{"seen", area, "map", CellRule::kCentre, 1.0}}});
    int64_t explored = 0;
    const SnapshotPtr now = snapshot();
    for (int i = 0; i < 64; ++i) {
      const Point centre{(i % 8 + 0.5) * kResolution_m, (i / 8 + 0.5) * kResolution_m};
      const PointContent content =
          now->FindLayer("seen")->ContentAt(map_from_turned.ApplyInverse(centre));
      explored += content.value == 1.0;
    }
    EXPECT_GT(explored, 0);
    EXPECT_EQ(Progress().explored, explored);
  }
}

TEST_F(ExplorationChangesTest, AMovedFrameCountsAtOnce) {
  Draw({"........"});
  LayerSpec seen;
  seen.name = "seen";
  seen.kind = LayerKind::kExploration;
  seen.frame_id = "robot";
  seen.grid = GridGeometry{PlanarTransform(), kResolution_m};
  Submit({{SetTransform{{"map", "robot", PlanarTransform()}}, CreateLayer{seen}}});
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  MarkExplored({0, 1, 0, 4});
  EXPECT_EQ(Progress().explored, 4);
  Submit({{SetTransform{{"map", "robot", PlanarTransform(3.0, 0, 0)}}}});
  EXPECT_EQ(Progress().explored, 2);
}

TEST_F(ExplorationChangesTest, ALayerThatIsGoneIsNamed) {
  StartInARoom();
  Submit({{DeleteLayer{"seen"}}});
  for (const absl::Status& status :
       {explorations().Get(0, "").status(), explorations().Claim({0, "r1", {0.25, 0.25}}).status(),
        explorations().ListFrontiers(0, "").status()}) {
    EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("\"seen\""));
  }
  EXPECT_TRUE(explorations().List("").ok());
  EXPECT_TRUE(explorations().Stop(0, "test").ok());
}

TEST_F(ExplorationChangesTest, ALayerThatIsMadeAgainIsFollowedAnew) {
  StartInARoom();
  MarkExplored({0, 4, 0, 8});
  EXPECT_EQ(Progress().explored, 32);
  const LayerSpec spec = snapshot()->FindLayer("seen")->spec();
  Submit({{DeleteLayer{"seen"}, CreateLayer{spec}}});
  EXPECT_EQ(Progress().explored, 0);
  EXPECT_EQ(Progress().reachable, 64);
}

TEST_F(ExplorationChangesTest, ALayerOfThatNameOfAnotherKindIsInTheWay) {
  Draw({"...."});
  LayerSpec taken = snapshot()->FindLayer("walls")->spec();
  taken.name = "explorations";
  Submit({{CreateLayer{taken}}});
  for (const absl::Status& status :
       {explorations().Start(WholeArea()).status(), explorations().List("").status(),
        explorations().Get(0, "").status()}) {
    EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("\"explorations\""));
  }
}

TEST_F(ExplorationChangesTest, TwoOfAMapGoOnSideBySide) {
  Draw(std::vector<std::string>(4, std::string(20, '.')));
  ExplorationStart left = WholeArea();
  left.area = Rectangle(0, 0, 4, 2);
  ExplorationStart right = WholeArea();
  right.area = Rectangle(6, 0, 10, 2);
  const ObjectId a = explorations().Start(left)->objects.exploration.id;
  const ObjectId b = explorations().Start(right)->objects.exploration.id;
  ASSERT_NE(a, b);
  ASSERT_TRUE(Claim("r1", {0.25, 0.25}, absl::Minutes(1), a).goal.has_value());
  // The robot has one goal in each exploration.
  ASSERT_TRUE(Claim("r1", {6.25, 0.25}, absl::Minutes(1), b).goal.has_value());
  MarkExplored({0, 4, 0, 8});
  EXPECT_EQ(Progress(a).explored, 32);
  EXPECT_EQ(Progress(b).explored, 0);
  EXPECT_EQ(Claim("r1", {0.25, 0.25}, absl::Minutes(1), a).end_reason, EndReason::kDone);
  const auto list = explorations().List("");
  ASSERT_THAT(list->explorations, SizeIs(2));
  EXPECT_EQ(list->explorations[0].exploration.id, b);
  EXPECT_EQ(list->explorations[0].exploration.state, ExplorationState::kActive);
  EXPECT_THAT(list->explorations[0].goals, SizeIs(1));
  EXPECT_EQ(list->explorations[1].exploration.state, ExplorationState::kEnded);
}

// Tests of edits by operators.

TEST_F(ExplorationChangesTest, WhatPeopleDeleteIsGone) {
  StartInARoom();
  const ObjectId goal = Claim("r1", {0.25, 0.25}).goal->id;
  DeleteByHand(goal);
  EXPECT_TRUE(absl::IsNotFound(
      explorations().Release({"r1", goal, GoalOutcome::kReached, "test"}).status()));
  const ObjectId other = Claim("r1", {0.25, 0.25}).goal->id;
  const ObjectId exploration = ExplorationId();
  DeleteByHand(exploration);
  EXPECT_TRUE(absl::IsNotFound(explorations().Get(exploration, "").status()));
  EXPECT_TRUE(absl::IsNotFound(explorations().Claim({0, "r1", {0.25, 0.25}}).status()));
  EXPECT_TRUE(absl::IsNotFound(
      explorations().Release({"r1", other, GoalOutcome::kReached, "test"}).status()));
  EXPECT_THAT(explorations().List("")->explorations, IsEmpty());
}

TEST_F(ExplorationChangesTest, PeopleMayMoveTheArea) {
  StartInARoom();
  EXPECT_EQ(Progress().reachable, 64);
  EditByHand(ExplorationId(), [](SemanticObject& object) { object.shape = Rectangle(0, 0, 1, 1); });
  EXPECT_EQ(Progress().reachable, 4);
}

TEST_F(ExplorationChangesTest, WhatPeopleAddToItStaysWhenItEnds) {
  StartInARoom();
  EditByHand(ExplorationId(), [](SemanticObject& object) {
    object.tags = {"night shift"};
    object.attributes["by"] = std::string("Ann");
  });
  ASSERT_TRUE(explorations().Stop(0, "test").ok());
  EditByHand(ExplorationId(), [](SemanticObject& object) {
    EXPECT_THAT(object.tags, ElementsAre("night shift"));
    EXPECT_EQ(std::get<std::string>(object.attributes["by"]), "Ann");
    EXPECT_EQ(std::get<std::string>(object.attributes["end_reason"]), "stopped");
  });
}

TEST_F(ExplorationChangesTest, WhatPeopleSpoilIsNamed) {
  StartInARoom();
  const ObjectId id = ExplorationId();
  EditByHand(id,
             [](SemanticObject& object) { object.attributes["state"] = std::string("paused"); });
  const absl::Status status = explorations().Claim({0, "r1", {0.25, 0.25}}).status();
  EXPECT_TRUE(absl::IsDataLoss(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("state"));
  EditByHand(id,
             [](SemanticObject& object) { object.attributes["state"] = std::string("active"); });
  EXPECT_TRUE(Claim("r1", {0.25, 0.25}).goal.has_value());
}

TEST_F(ExplorationChangesTest, ARobotOfTooManyCellsIsRefusedByName) {
  DrawFree("fine", 0.01, 4);
  ExplorationStart request = WholeArea();
  request.area = Rectangle(0, 0, 0.04, 0.04);
  request.occupancy_layer = "fine";
  request.robot_radius_m = 1.02;
  const absl::Status refused = explorations().Start(request).status();
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("robot_radius_m"));
  request.robot_radius_m = 1.0;
  ASSERT_TRUE(explorations().Start(request).ok());

  // As if it had been started by an older server.
  EditByHand(ExplorationId(),
             [](SemanticObject& object) { object.attributes["robot_radius_m"] = 1.02; });
  Reopen();
  for (const absl::Status& status :
       {explorations().Get(0, "").status(), explorations().Claim({0, "r1", {0.02, 0.02}}).status(),
        explorations().ListFrontiers(0, "").status()}) {
    EXPECT_TRUE(absl::IsResourceExhausted(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("robot_radius_m"));
  }
  EXPECT_TRUE(explorations().List("").ok());
  EXPECT_TRUE(explorations().Stop(0, "test").ok());
}

// Tests of the end of explorations.

TEST_F(ExplorationChangesTest, StopEndsItAndAgainIsANoOp) {
  StartInARoom();
  MarkExplored({0, 1, 0, 8});
  const ObjectId goal = Claim("r1", {0.25, 0.25}).goal->id;
  const Explorer::Progress progress = Progress();
  Advance(absl::Seconds(7));
  const auto stopped = explorations().Stop(0, "test");
  ASSERT_TRUE(stopped.ok()) << stopped.status();
  EXPECT_EQ(stopped->objects.exploration.state, ExplorationState::kEnded);
  EXPECT_EQ(stopped->objects.exploration.end_reason, EndReason::kStopped);
  EXPECT_EQ(stopped->objects.exploration.ended, Now());
  EXPECT_THAT(Goals(), IsEmpty());
  ExpectSame(Progress(), progress);

  const Revision after = snapshot()->revision;
  Advance(absl::Seconds(7));
  const auto again = explorations().Stop(0, "test");
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->objects.exploration, stopped->objects.exploration);
  const auto claimed = Claim("r1", {0.25, 0.25});
  EXPECT_EQ(claimed.state, ExplorationState::kEnded);
  EXPECT_EQ(claimed.end_reason, EndReason::kStopped);
  EXPECT_FALSE(claimed.goal.has_value());
  EXPECT_TRUE(
      absl::IsNotFound(explorations().Renew({"r1", goal, absl::Minutes(1), "test"}).status()));
  EXPECT_TRUE(absl::IsFailedPrecondition(explorations().ListFrontiers(0, "").status()));
  EXPECT_EQ(snapshot()->revision, after);
}

TEST_F(ExplorationChangesTest, ACallIsMadeAgainWhenSomebodyElseChangesTheLayer) {
  StartInARoom();
  // An operator edits the layer all the while.
  std::atomic<bool> done = false;
  const ObjectId exploration = ExplorationId();
  std::thread people([&] {
    while (!done) {
      EditByHand(exploration, [](SemanticObject& object) { object.existence = 0.5; });
    }
  });
  int claimed = 0;
  for (int i = 0; i < 50; ++i) {
    claimed += explorations().Claim({0, "r1", {0.25, 0.25}, "", absl::Minutes(1), "test"}).ok();
  }
  done = true;
  people.join();
  EXPECT_GT(claimed, 0);
  EXPECT_THAT(Goals(), SizeIs(1));
}

TEST_F(ExplorationChangesTest, RateIsOfTheLastMinute) {
  StartInARoom();
  EXPECT_EQ(explorations().Get(0, "")->progress.rate_m2_per_s, 0.0);
  Advance(absl::Seconds(10));
  MarkExplored({0, 2, 0, 8});
  EXPECT_DOUBLE_EQ(explorations().Get(0, "")->progress.rate_m2_per_s, 16 * 0.25 / 10);
  Advance(absl::Seconds(60));
  EXPECT_DOUBLE_EQ(explorations().Get(0, "")->progress.rate_m2_per_s, 0.0);
}

TEST_F(ExplorationChangesTest, FrontiersAreTheLargestFirst) {
  Draw({"...#......",  //
        "...#######",  //
        "...#......"});
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  EXPECT_THAT(explorations().ListFrontiers(0, "")->frontiers, IsEmpty());
  MarkExplored({0, 1, 4, 5});
  MarkExplored({0, 3, 0, 1});
  const auto list = explorations().ListFrontiers(0, "");
  ASSERT_TRUE(list.ok()) << list.status();
  ASSERT_THAT(list->frontiers, SizeIs(2));
  EXPECT_THAT(list->frontiers[0].cells,
              ElementsAre(CellIndex{0, 1}, CellIndex{1, 1}, CellIndex{2, 1}));
  EXPECT_THAT(list->frontiers[1].cells, ElementsAre(CellIndex{0, 5}));
  EXPECT_TRUE(list->frontiers[0].viewpoint.has_value());
}

}  // namespace
}  // namespace hypermap::server
