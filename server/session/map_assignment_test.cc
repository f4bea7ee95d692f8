#include "server/session/map_assignment.h"

#include <algorithm>
#include <map>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap::server {
namespace {

using hypermap::testing::UniformInt;
using storage::Survey;
using Servers = std::vector<std::string>;
using Maps = std::vector<Survey::Map>;

Survey::Map MapOf(int i) { return {absl::StrCat("map-", i), 7, 3, ""}; }

Maps MapsOf(int count) {
  Maps maps;
  for (int i = 0; i < count; ++i) maps.push_back(MapOf(i));
  return maps;
}

Servers ServersOf(int count) {
  Servers servers;
  for (int i = 0; i < count; ++i) servers.push_back(absl::StrCat("server-", i));
  return servers;
}

// Gives each map to the server that it is to belong to. Returns the number of maps that have moved
// from one server to another.
int CarryOut(Maps& maps, const Servers& servers) {
  const std::vector<std::string> homes = AssignMaps(maps, servers);
  int moves = 0;
  for (size_t i = 0; i < maps.size(); ++i) {
    if (maps[i].owner != homes[i] && !maps[i].owner.empty()) ++moves;
    maps[i].owner = homes[i];
  }
  return moves;
}

std::map<std::string, size_t> LoadsOf(const Maps& maps) {
  std::map<std::string, size_t> loads;
  for (const Survey::Map& map : maps) ++loads[map.owner];
  return loads;
}

// The server with the greatest hash: the one of a map that is alone.
std::string FirstChoice(const Survey::Map& map, const Servers& servers) {
  return AssignMaps({{map.name, 1, 0, ""}}, servers)[0];
}

int CountMovesOfPlainHashing(const Maps& maps, const Servers& before, const Servers& after) {
  return static_cast<int>(std::count_if(maps.begin(), maps.end(), [&](const Survey::Map& map) {
    return FirstChoice(map, before) != FirstChoice(map, after);
  }));
}

TEST(MapAssignmentTest, WithoutServersNoMapHasAHome) {
  EXPECT_EQ(AssignMaps(MapsOf(2), {}), std::vector<std::string>(2));
}

TEST(MapAssignmentTest, MapsAreAtTheirFirstChoiceWhileThereIsRoom) {
  Maps maps = MapsOf(1000);
  const Servers servers = ServersOf(4);
  CarryOut(maps, servers);
  for (const Survey::Map& map : maps) EXPECT_EQ(map.owner, FirstChoice(map, servers)) << map.name;
}

TEST(MapAssignmentTest, NoServerIsAboveItsBoundAndAPlanThatWasCarriedOutMovesNothing) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng random(seed);
  for (int round = 0; round < 500; ++round) {
    const Servers servers = ServersOf(UniformInt(random, 1, 6));
    Maps maps = MapsOf(UniformInt(random, 0, 60));
    // Also servers that are gone, and maps without an owner.
    for (Survey::Map& map : maps) {
      const int i = UniformInt(random, -1, static_cast<int>(servers.size()) + 1);
      if (i >= 0) map.owner = absl::StrCat("server-", i);
    }
    CarryOut(maps, servers);
    const double mean = static_cast<double>(maps.size()) / static_cast<double>(servers.size());
    for (const auto& [server, load] : LoadsOf(maps)) EXPECT_LT(load, 1.25 * mean + 1) << server;
    EXPECT_EQ(CarryOut(maps, servers), 0);
  }
}

TEST(MapAssignmentTest, FewMapsMoveWhenAServerComesOrGoes) {
  const Servers few = ServersOf(3);
  const Servers many = ServersOf(4);
  Maps maps = MapsOf(60);
  CarryOut(maps, few);
  const int to_new = CarryOut(maps, many);
  EXPECT_GT(LoadsOf(maps)[many.back()], 10u);
  EXPECT_LE(to_new, 15);
  EXPECT_LE(to_new, CountMovesOfPlainHashing(maps, few, many));
  const int of_gone = static_cast<int>(LoadsOf(maps)[many.back()]);
  const int from_gone = CarryOut(maps, few);
  EXPECT_LE(from_gone, of_gone + 2);
  EXPECT_LE(from_gone, CountMovesOfPlainHashing(maps, many, few));
}

TEST(MapAssignmentTest, MapsThatGoToASecondChoiceReturnOnlyOnceThereIsMuchRoom) {
  const Servers servers = ServersOf(2);
  // Of one first choice, whose bound is 5 of 8 maps.
  Maps maps;
  for (int i = 0; maps.size() < 8; ++i) {
    if (FirstChoice(MapOf(i), servers) == servers[0]) maps.push_back(MapOf(i));
  }
  CarryOut(maps, servers);
  EXPECT_EQ(LoadsOf(maps)[servers[0]], 5u);
  const auto remove_one = [&] {
    const auto found = std::find_if(
        maps.begin(), maps.end(), [&](const Survey::Map& map) { return map.owner == servers[0]; });
    Survey::Map removed = *found;
    maps.erase(found);
    return removed;
  };
  // A map that comes and goes moves no other, although the bound is 5 and then 4.
  const Survey::Map wobbling = remove_one();
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(CarryOut(maps, servers), 0);
    maps.push_back(wobbling);
    EXPECT_EQ(CarryOut(maps, servers), 0);
    maps.pop_back();
  }
  remove_one();
  remove_one();
  EXPECT_EQ(LoadsOf(maps)[servers[0]], 2u);
  // The mean of 5 maps is 3, rounded up.
  EXPECT_EQ(CarryOut(maps, servers), 1);
  EXPECT_EQ(LoadsOf(maps)[servers[0]], 3u);
}

TEST(MapAssignmentTest, EditsMoveNothing) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng random(seed);
  const Servers servers = ServersOf(3);
  Maps maps = MapsOf(60);
  CarryOut(maps, servers);
  for (int round = 0; round < 100; ++round) {
    for (Survey::Map& map : maps) map.revision += UniformInt(random, 0, 1000);
    EXPECT_EQ(CarryOut(maps, servers), 0);
  }
}

TEST(MapAssignmentTest, MapsUnderWayAreCountedWhereTheyGo) {
  // Servers see maps move one after the other, and must go on to agree.
  const Servers few = ServersOf(3);
  const Servers many = ServersOf(4);
  Maps maps = MapsOf(60);
  CarryOut(maps, few);
  const std::vector<std::string> planned = AssignMaps(maps, many);
  for (size_t i = 0; i < maps.size(); ++i) {
    if (maps[i].owner == planned[i]) continue;
    maps[i].owner = "";
    EXPECT_EQ(AssignMaps(maps, many), planned) << maps[i].name << " has left";
    maps[i].owner = planned[i];
    EXPECT_EQ(AssignMaps(maps, many), planned) << maps[i].name << " has arrived";
  }
}

}  // namespace
}  // namespace hypermap::server
