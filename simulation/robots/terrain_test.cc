#include "simulation/robots/terrain.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "map/exploration/path.h"
#include "simulation/robots/testing/drawn_site.h"
#include "tests/support/random_map.h"

namespace hypermap::robots {
namespace {

using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::Uniform;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

int32_t LengthOf(const std::vector<CellIndex>& path) {
  int32_t length = 0;
  for (size_t i = 1; i < path.size(); ++i) {
    const bool aslant = path[i].row != path[i - 1].row && path[i].col != path[i - 1].col;
    length += aslant ? PathSearch::kAslant : PathSearch::kStraight;
  }
  return length;
}

TEST(TerrainTest, FloorIsWhatIsFreeInTheArea) {
  const auto site = DrawnSite({"...#", "..?."});
  const Terrain terrain(*site, Polygon::FromBox({{0, 0}, {3, 2}}), 0.0);
  EXPECT_TRUE(terrain.IsFloor({0, 0}));
  EXPECT_TRUE(terrain.IsFloor({1, 2}));
  EXPECT_FALSE(terrain.IsFloor({0, 2})) << "unknown";
  EXPECT_FALSE(terrain.IsFloor({0, 3})) << "out of the area";
  EXPECT_FALSE(terrain.IsFloor({1, 3})) << "a wall";
  EXPECT_EQ(terrain.plan().at({0, 3}), Floor::kFree);
  EXPECT_EQ(terrain.plan().at({-1, 0}), Floor::kUnknown);
}

TEST(TerrainTest, RobotsKeepAwayFromWalls) {
  const auto site = DrawnSite({".....", ".....", "..#..", ".....", "....."});
  const Terrain terrain(*site, Polygon::FromBox({{0, 0}, {5, 5}}), 1.1);
  EXPECT_FALSE(terrain.IsPassable({2, 3})) << "beside the wall";
  EXPECT_TRUE(terrain.IsPassable({1, 3}));
  EXPECT_FALSE(terrain.IsPassable({0, 0})) << "beside what nobody knows";
  EXPECT_EQ(terrain.NearestPassable({3.5, 2.5}, 1.0), (CellIndex{1, 3}));
  EXPECT_EQ(terrain.NearestPassable({3.5, 2.5}, 0.5), std::nullopt);
}

TEST(TerrainTest, ThereIsNoWayThroughWallsOrPastTheirCorners) {
  const auto site = DrawnSite({"..#.", ".#..", "..#."});
  const Terrain terrain(*site, Polygon::FromBox({{0, 0}, {4, 3}}), 0.0);
  EXPECT_THAT(terrain.ShortestPath({0, 0}, {0, 3}), IsEmpty());
  EXPECT_THAT(terrain.ShortestPath({0, 0}, {1, 1}), IsEmpty());
  EXPECT_THAT(terrain.ShortestPath({0, 0}, {0, 0}), ElementsAre(CellIndex{0, 0}));
  EXPECT_THAT(terrain.ShortestPath({0, 0}, {1, 0}), SizeIs(2));
  EXPECT_THAT(terrain.LargestRegion(), SizeIs(5)) << "the left side, of its two";
}

// The oracle for A* is Dijkstra's algorithm.
TEST(TerrainTest, WaysAreAsShortAsCanBe) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  for (int round = 0; round < 30; ++round) {
    std::vector<std::string> lines(24, std::string(24, '.'));
    for (std::string& line : lines) {
      for (char& c : line) c = Uniform(rng, 0, 1) < 0.3 ? '#' : '.';
    }
    lines[12][12] = '.';
    const auto site = DrawnSite(lines);
    const Terrain terrain(*site, Polygon::FromBox({{0, 0}, {24, 24}}), 0.0);
    const CellIndex from{11, 12};
    int found = 0;
    PathSearch(terrain.plan().box())
        .Run(
            from, [&](const CellIndex& cell) { return terrain.IsPassable(cell); },
            [&](const CellIndex& cell, int32_t length) {
              const std::vector<CellIndex> path = terrain.ShortestPath(from, cell);
              EXPECT_EQ(LengthOf(path), length);
              EXPECT_EQ(path.front(), from);
              EXPECT_EQ(path.back(), cell);
              ++found;
              return true;
            });
    EXPECT_EQ(static_cast<size_t>(found), terrain.ReachableFrom(from).size());
  }
}

}  // namespace
}  // namespace hypermap::robots
