#include "map/exploration/explorer.h"

#include <algorithm>
#include <set>

#include "base/cancellation/cancellation.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/exploration/testing/drawn_floor.h"
#include "map/layers/layer_registry.h"

namespace hypermap {
namespace {

using testing::DrawnFloor;
using ::testing::IsEmpty;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

constexpr double kResolution_m = 0.1;

std::shared_ptr<const GridLayer> Write(std::shared_ptr<const GridLayer> grid, const CellBox& box,
                                       const std::vector<std::optional<double>>& values) {
  GridWriter writer(std::move(grid));
  EXPECT_TRUE(writer.Write(box, values).ok());
  return std::move(writer).Finish().layer;
}

std::shared_ptr<const GridLayer> Occupancy(const FloorPlan& plan) {
  std::vector<std::optional<double>> values;
  for (const Floor floor : plan.values()) {
    values.push_back(floor == Floor::kUnknown
                         ? std::nullopt
                         : std::optional<double>(floor == Floor::kFree ? 0.0 : 1.0));
  }
  GridGeometry geometry;
  geometry.resolution_m = kResolution_m;
  return Write(
      std::static_pointer_cast<const GridLayer>(MakeEmptyLayer(
          {.name = "grid", .kind = LayerKind::kOccupancy, .frame_id = "map", .grid = geometry})),
      plan.box(), values);
}

Polygon AreaOf(const CellBox& box) {
  return Polygon::FromBox({{box.col_begin * kResolution_m, box.row_begin * kResolution_m},
                           {box.col_end * kResolution_m, box.row_end * kResolution_m}});
}

// A site, the part of it that robots have seen, and an Explorer that follows both.
class Site {
 public:
  Site(const FloorPlan& plan, Explorer::Options options)
      : options_(options),
        plan_(plan),
        occupancy_(Occupancy(plan)),
        explorer_(*occupancy_, AreaOf(plan.box()), options),
        viewshed_rays_(Explorer::RangeIn(explorer_.box(), options, kResolution_m)) {}

  Explorer& explorer() { return explorer_; }
  const FloorPlan& plan() const { return plan_; }
  const std::set<CellIndex>& seen() const { return seen_; }

  std::set<CellIndex> VisibleFrom(const CellIndex& cell) {
    std::set<CellIndex> visible;
    viewshed_rays_.ForEachVisible(plan_, cell, [&](const CellIndex& c) { visible.insert(c); });
    return visible;
  }

  void See(const CellIndex& from) {
    CellBox box;
    for (const CellIndex& cell : VisibleFrom(from)) {
      seen_.insert(cell);
      box = box.Union({cell.row, cell.row + 1, cell.col, cell.col + 1});
    }
    explorer_.UpdateExplored(box, [this](const CellIndex& c) { return seen_.contains(c); });
  }

  void Build(const CellBox& box, Floor floor) {
    for (int32_t row = box.row_begin; row < box.row_end; ++row) {
      for (int32_t col = box.col_begin; col < box.col_end; ++col) plan_.set({row, col}, floor);
    }
    occupancy_ = Write(
        occupancy_, box,
        std::vector<std::optional<double>>(box.num_cells(), floor == Floor::kFree ? 0.0 : 1.0));
    explorer_.UpdateFloor(*occupancy_, box);
  }

  // Returns an Explorer that starts from the present state, without having followed the changes.
  Explorer Afresh() const {
    Explorer fresh(*occupancy_, AreaOf(plan_.box()), options_);
    fresh.UpdateExplored(fresh.box(), [this](const CellIndex& c) { return seen_.contains(c); });
    return fresh;
  }

 private:
  Explorer::Options options_;
  FloorPlan plan_;
  std::shared_ptr<const GridLayer> occupancy_;
  Explorer explorer_;
  ViewshedRays viewshed_rays_;
  std::set<CellIndex> seen_;
};

void ExpectSame(Explorer& a, Explorer& b) {
  const Explorer::Progress p = a.progress(), q = b.progress();
  EXPECT_EQ(p.explored, q.explored);
  EXPECT_EQ(p.reachable, q.reachable);
  EXPECT_EQ(p.unreachable, q.unreachable);
  const auto some = a.ListFrontiers(), others = b.ListFrontiers();
  ASSERT_EQ(some.size(), others.size());
  for (size_t i = 0; i < some.size(); ++i) {
    EXPECT_EQ(some[i].cells, others[i].cells);
    EXPECT_EQ(some[i].viewpoint, others[i].viewpoint);
  }
}

FloorPlan Rooms() {
  return DrawnFloor({"##############################",  //
                     "#.........#..................#",  //
                     "#.........#..................#",  //
                     "#.........#..................#",  //
                     "#.........#.....######.......#",  //
                     "#...............#....#.......#",  //
                     "#...............#....#.......#",  //
                     "#...............#....#.......#",  //
                     "#.........#.....######.......#",  //
                     "#.........#..................#",  //
                     "#.........#..................#",  //
                     "#.........#..................#",  //
                     "##############################"});
}

// Wherever its construction is given up, an Explorer can be asked for no more than its end.
TEST(ExplorerTest, ConstructionCanBeGivenUpAtEachLook) {
  const FloorPlan plan = DrawnFloor({"........", "..##....", "........", "....#..."});
  const auto occupancy = Occupancy(plan);
  int num_given_up = 0;
  for (bool is_given_up = true; is_given_up; num_given_up += is_given_up) {
    int looks = 0;
    Cancellation cancellation(
        [&] { return looks++ < num_given_up ? absl::OkStatus() : absl::CancelledError("gone"); },
        absl::ZeroDuration());
    const ScopedCancellation here(&cancellation);
    Explorer explorer(*occupancy, AreaOf(plan.box()), Explorer::Options{});
    is_given_up = !cancellation.status().ok();
    if (!is_given_up) {
      EXPECT_EQ(explorer.box().Intersection(plan.box()), plan.box());
    }
    explorer.UpdateExplored(plan.box(), [](const CellIndex&) { return true; });
  }
  EXPECT_GT(num_given_up, 8);
}

TEST(ExplorerTest, EqualsOneThatBeginsAfreshThroughChanges) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  for (int round = 0; round < 6; ++round) {
    FloorPlan plan(CellBox{-5, 45, 3, 60}, Floor::kUnknown);
    for (Floor& floor : plan.mutable_values()) {
      floor = Uniform(rng, 0, 1) < 0.02 ? Floor::kOccupied : Floor::kFree;
    }
    Site site(plan, {.robot_radius_m = Uniform(rng, 0, 0.3), .range_m = Uniform(rng, 0.5, 2)});
    for (int step = 0; step < 12; ++step) {
      const CellIndex at = plan.CellOf(UniformInt(rng, 0, plan.values().size() - 1));
      if (UniformInt(rng, 0, 2) == 0) {
        const CellBox box{at.row, std::min(at.row + 3, plan.box().row_end), at.col,
                          std::min(at.col + 4, plan.box().col_end)};
        site.Build(box, UniformInt(rng, 0, 1) == 0 ? Floor::kFree : Floor::kOccupied);
      } else {
        site.See(at);
      }
      Explorer fresh = site.Afresh();
      ExpectSame(site.explorer(), fresh);
    }
  }
}

TEST(ExplorerTest, SeesAllThatCanBeSeenAndEnds) {
  for (const double range_m : {0.6, 1.0, 4.0}) {
    Site site(Rooms(), {.robot_radius_m = 0.12, .range_m = range_m, .min_gain_cells = 1});
    CellIndex robot{5, 3};
    site.explorer().AddRobot(robot);
    int looks = 0;
    while (const auto goal = site.explorer().ChooseViewpoint(robot, {}, {})) {
      ASSERT_LT(++looks, 500);
      EXPECT_GT(goal->viewpoint.gain_cells, 0);
      robot = goal->viewpoint.cell;
      const size_t before = site.seen().size();
      site.See(robot);
      EXPECT_EQ(site.seen().size() - before, goal->viewpoint.gain_cells);
      site.explorer().LookedRound(robot);
    }
    // Brute force: collect the cells that can be seen from all places where a robot can be.
    PathSearch paths(site.plan().box());
    const Clearance clearance(site.plan(), 0.12, kResolution_m);
    std::set<CellIndex> visible;
    paths.Run(
        robot, [&](const CellIndex& cell) { return clearance.IsClear(cell); },
        [&](const CellIndex& cell, int32_t) {
          visible.merge(site.VisibleFrom(cell));
          return true;
        });
    std::vector<CellIndex> missed;
    std::set_difference(visible.begin(), visible.end(), site.seen().begin(), site.seen().end(),
                        std::back_inserter(missed));
    EXPECT_LE(missed.size(), visible.size() / 100);
    // The closed chamber remains.
    EXPECT_EQ(site.explorer().progress().unreachable, 3 * 4);
    EXPECT_FALSE(site.seen().contains({6, 18}));
  }
}

TEST(ExplorerTest, RobotsAreSentApart) {
  Site site(Rooms(), {.robot_radius_m = 0.12, .range_m = 0.6});
  const CellIndex robot{5, 3};
  const auto first = site.explorer().ChooseViewpoint(robot, {}, {});
  ASSERT_TRUE(first.has_value());
  const auto second = site.explorer().ChooseViewpoint(robot, {first->viewpoint.cell}, {});
  ASSERT_TRUE(second.has_value());
  const CellIndex a = first->viewpoint.cell, b = second->viewpoint.cell;
  EXPECT_GE(std::hypot(a.row - b.row, a.col - b.col), 4);
  const std::set<CellIndex> promised = site.VisibleFrom(a);
  int64_t gain = 0;
  for (const CellIndex& cell : site.VisibleFrom(b)) gain += !promised.contains(cell);
  EXPECT_EQ(second->viewpoint.gain_cells, gain);
}

TEST(ExplorerTest, AvoidsPlacesThatAreNotReached) {
  Site site(Rooms(), {.robot_radius_m = 0.12, .range_m = 0.6});
  CellRaster<uint8_t> avoided(site.explorer().box());
  for (int i = 0; i < 5; ++i) {
    const auto goal = site.explorer().ChooseViewpoint({5, 3}, {}, avoided);
    ASSERT_TRUE(goal.has_value());
    EXPECT_EQ(avoided.at(goal->viewpoint.cell), 0);
    avoided.set(goal->viewpoint.cell, 1);
  }
}

TEST(ExplorerTest, WhatDoesNotShowIsGivenUpUntilTheFloorChanges) {
  Site site(DrawnFloor({"......", "......"}), {.robot_radius_m = 0.0, .range_m = 2.0});
  EXPECT_EQ(site.explorer().progress().reachable, 12);
  site.explorer().LookedRound({0, 0});
  EXPECT_EQ(site.explorer().progress().reachable, 12);
  site.explorer().LookedRound({0, 0});
  EXPECT_EQ(site.explorer().progress().unreachable, 12);
  EXPECT_FALSE(site.explorer().ChooseViewpoint({0, 0}, {}, {}).has_value());
  site.Build({1, 2, 5, 6}, Floor::kOccupied);
  EXPECT_EQ(site.explorer().progress().reachable, 11);
  EXPECT_TRUE(site.explorer().ChooseViewpoint({0, 0}, {}, {}).has_value());
}

TEST(ExplorerTest, KeepsToTheArea) {
  const FloorPlan plan = DrawnFloor({"..........", "..........", ".........."});
  const auto occupancy = Occupancy(plan);
  Explorer explorer(*occupancy, AreaOf({0, 3, 2, 5}), {.robot_radius_m = 0.0, .range_m = 1.0});
  EXPECT_EQ(explorer.progress().reachable, 9);
  const auto goal = explorer.ChooseViewpoint({1, 2}, {}, {});
  ASSERT_TRUE(goal.has_value());
  EXPECT_EQ(goal->viewpoint.gain_cells, 9);
  EXPECT_FALSE(explorer.ChooseViewpoint({1, 9}, {}, {}).has_value());
}

TEST(ExplorerTest, OnlyCellsThatCountAreFollowed) {
  const auto occupancy = Occupancy(DrawnFloor({"..........", "..........", ".........."}));
  const Polygon everywhere = Polygon::FromBox({{-1e6, -1e6}, {1e6, 1e6}});
  const Explorer::Options options{.robot_radius_m = 0.0, .range_m = 1.0};
  const CellBox within{0, 3, 4, 40};
  Explorer explorer(*occupancy, everywhere, options, within);
  EXPECT_EQ(explorer.box(), Explorer::BoxOf(occupancy->geometry(), everywhere, options, within));
  EXPECT_TRUE(explorer.box().Contains(within));
  EXPECT_LT(explorer.box().num_cells(), 5 * 38 + 1);
  EXPECT_EQ(explorer.progress().reachable, 18);
  EXPECT_TRUE(
      Explorer::BoxOf(occupancy->geometry(), AreaOf({0, 3, 0, 2}), options, within).empty());
}

TEST(ExplorerTest, TellsWhereFloorChanged) {
  const auto occupancy = Occupancy(DrawnFloor({"....", "...."}));
  Explorer explorer(*occupancy, AreaOf({0, 2, 0, 4}), {.robot_radius_m = 0.0, .range_m = 1.0});
  const auto after = Write(occupancy, {0, 2, 0, 4}, {0.1, 0.1, 1.0, 1.0, 0.1, 0.1, 0.1, 1.0});
  EXPECT_EQ(explorer.UpdateFloor(*after, {0, 2, 0, 4}), (CellBox{0, 2, 2, 4}));
  EXPECT_TRUE(explorer.UpdateFloor(*after, {0, 2, 0, 4}).empty());
}

TEST(ExplorerTest, ANewOneIsCheaperWhenWideRobotsLoseMuchFloor) {
  const CellBox box{0, 250, 0, 250};
  const auto occupancy =
      Write(Occupancy(DrawnFloor({"."})), box,
            std::vector<std::optional<double>>(static_cast<size_t>(box.num_cells()), 0.0));
  const auto is_cheaper_anew = [&](double radius_m, const CellBox& part, double value) {
    const Explorer explorer(*occupancy, AreaOf(box), {.robot_radius_m = radius_m, .range_m = 1.0});
    const std::vector<std::optional<double>> values(static_cast<size_t>(part.num_cells()), value);
    return explorer.IsCheaperAnew(*Write(occupancy, part, values), {part});
  };
  EXPECT_TRUE(is_cheaper_anew(5.0, box, 1.0));
  EXPECT_FALSE(is_cheaper_anew(5.0, {0, 100, 0, 100}, 1.0));
  EXPECT_FALSE(is_cheaper_anew(0.3, box, 1.0));
  EXPECT_FALSE(is_cheaper_anew(5.0, box, 0.1)) << "the cells are still free";
}

TEST(ExplorerTest, ReachabilityIsThatOfTheRobots) {
  const FloorPlan plan = DrawnFloor({"...#...", "...#...", "...#..."});
  Site site(plan, {.robot_radius_m = 0.0, .range_m = 1.0});
  EXPECT_EQ(site.explorer().progress().reachable, 18);
  site.explorer().AddRobot({0, 0});
  EXPECT_EQ(site.explorer().progress().reachable, 9);
  EXPECT_EQ(site.explorer().progress().unreachable, 9);
  site.explorer().AddRobot({0, 6});
  EXPECT_EQ(site.explorer().progress().reachable, 18);
}

// No view reveals as much as is wanted, but only looking at all of them shows it.
TEST(ExplorerTest, SearchThatLeavesOutPlacesComesToAnEndWhenItIsAskedAgain) {
  Rng rng(1);
  const FloorPlan plan = testing::RandomFloor(rng, 60, 0.1);
  Explorer::Options options{.robot_radius_m = 0.0, .range_m = 1.5, .min_gain_cells = 600};
  Site patient(plan, options);
  const std::vector<CellIndex> robots{{30, 30}, {30, 31}, {0, 0}};
  ASSERT_FALSE(patient.explorer().IsAnythingLeft(robots, {}));
  options.max_looked = 20'000;
  Site site(plan, options);
  int times = 1;
  while (site.explorer().IsAnythingLeft(robots, {})) {
    EXPECT_FALSE(site.explorer().ChooseViewpoint(robots[0], {}, {}).has_value());
    ASSERT_LT(++times, 100);
  }
  EXPECT_GT(times, 1);
}

TEST(ExplorerTest, SearchThatLooksAtLittleFindsAGoalAllTheSame) {
  Site site(Rooms(), {.robot_radius_m = 0.12, .range_m = 1.0, .max_looked = 1});
  const CellIndex robot{5, 3};
  site.See(robot);
  EXPECT_TRUE(site.explorer().IsAnythingLeft({robot}, {}));
  const auto goal = site.explorer().ChooseViewpoint(robot, {}, {});
  ASSERT_TRUE(goal.has_value());
  EXPECT_GT(goal->viewpoint.gain_cells, 0);
}

TEST(ExplorerTest, RangeBeyondTheAreaIsTheWholeArea) {
  Site site(Rooms(), {.robot_radius_m = 0.12, .range_m = 5.0});
  Site far(Rooms(), {.robot_radius_m = 0.12, .range_m = 1e9});
  const auto near_goal = site.explorer().ChooseViewpoint({5, 3}, {}, {});
  const auto far_goal = far.explorer().ChooseViewpoint({5, 3}, {}, {});
  ASSERT_TRUE(near_goal && far_goal);
  EXPECT_EQ(near_goal->viewpoint, far_goal->viewpoint);
}

TEST(ExplorerTest, ThereMayBeNoFloorAtAll) {
  const FloorPlan plan = DrawnFloor({"##", "??"});
  Site site(plan, {});
  EXPECT_THAT(site.explorer().ListFrontiers(), IsEmpty());
  EXPECT_FALSE(site.explorer().ChooseViewpoint({0, 0}, {}, {}).has_value());
}

TEST(ExplorerTest, FrontiersHaveAPlaceToSeeThemFrom) {
  Site site(Rooms(), {.robot_radius_m = 0.12, .range_m = 1.0});
  site.See({5, 3});
  const auto frontiers = site.explorer().ListFrontiers();
  ASSERT_FALSE(frontiers.empty());
  for (const auto& frontier : frontiers) {
    if (!frontier.viewpoint) continue;
    int64_t gain = 0;
    for (const CellIndex& cell : site.VisibleFrom(frontier.viewpoint->cell)) {
      gain += !site.seen().contains(cell);
    }
    EXPECT_EQ(frontier.viewpoint->gain_cells, gain);
  }
  EXPECT_TRUE(std::any_of(frontiers.begin(), frontiers.end(),
                          [](const auto& frontier) { return frontier.viewpoint.has_value(); }));
}

// Holds even where the view round a corner would be worth it.
TEST(ExplorerTest, GoalsOfTwoRobotsAreNotInOnePlace) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  int near_others = 0;
  for (int round = 0; round < 300; ++round) {
    const FloorPlan plan = testing::RandomFloor(rng, 40, 0.06);
    const auto any_cell = [&] { return plan.CellOf(UniformInt(rng, 0, 40 * 40 - 1)); };
    Site lonely(plan, {.robot_radius_m = 0.0, .range_m = 2.0});
    Site site(plan, {.robot_radius_m = 0.14, .range_m = 2.0});
    const CellIndex robot = any_cell(), other = any_cell();
    const auto distance = [&other](const CellIndex& cell) {
      return std::hypot(cell.row - other.row, cell.col - other.col);
    };
    const auto goal = site.explorer().ChooseViewpoint(robot, {other}, {});
    EXPECT_TRUE(!goal || distance(goal->viewpoint.cell) >= 2.8);
    const auto point = lonely.explorer().ChooseViewpoint(other, {other}, {});
    near_others += point && distance(point->viewpoint.cell) < 2.8;
  }
  EXPECT_GT(near_others, 0) << "robots without a width may come as near";
}

}  // namespace
}  // namespace hypermap
