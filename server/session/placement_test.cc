#include "server/session/placement.h"

#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap::server {
namespace {

using Action = Placement::Action;
using storage::Survey;

const absl::Duration kLater = Placement::kSettle + absl::Seconds(1);

Survey SurveyOf(const std::vector<std::string>& servers, const std::vector<std::string>& maps,
                const std::string& owner = "") {
  Survey survey;
  for (const std::string& server : servers) survey.servers.push_back({server, server + ":1"});
  for (const std::string& map : maps) survey.maps.push_back({map, 7, 3, owner});
  return survey;
}

std::vector<std::string> ManyMaps() {
  std::vector<std::string> maps;
  maps.reserve(1000);
  for (int i = 0; i < 1000; ++i) maps.push_back(absl::StrCat("map-", i));
  return maps;
}

// The server that has settled longest takes what belongs to it; `servers` live from the beginning.
std::map<std::string, std::string> HomesOf(const std::vector<std::string>& servers,
                                           const std::vector<std::string>& maps) {
  std::map<std::string, std::string> homes;
  for (const std::string& server : servers) {
    Placement placement(server);
    for (const auto& task : placement.Plan(SurveyOf(servers, maps), {}, absl::ZeroDuration())) {
      if (task.action != Action::kOwn) continue;
      EXPECT_TRUE(homes.emplace(task.map, server).second) << task.map << " has two homes";
    }
  }
  return homes;
}

TEST(PlacementTest, EachMapHasOneHomeAndTheyAreSpread) {
  const std::map<std::string, std::string> homes = HomesOf({"a", "b", "c"}, ManyMaps());
  EXPECT_EQ(homes.size(), 1000u);
  std::map<std::string, int> maps_of;
  for (const auto& [map, server] : homes) ++maps_of[server];
  for (const auto& [server, count] : maps_of) {
    EXPECT_GT(count, 250) << server;
    EXPECT_LT(count, 420) << server;
  }
}

TEST(PlacementTest, ServerThatComesTakesMapsOnlyForItself) {
  const auto before = HomesOf({"a", "b"}, ManyMaps());
  const auto after = HomesOf({"a", "b", "c"}, ManyMaps());
  for (const auto& [map, server] : after) {
    if (server != "c") EXPECT_EQ(server, before.at(map)) << map;
  }
}

TEST(PlacementTest, MapWithAnOwnerIsFollowed) {
  Placement placement("a");
  const auto tasks = placement.Plan(SurveyOf({"a", "b"}, {"site"}, "b"), {}, absl::ZeroDuration());
  ASSERT_EQ(tasks.size(), 1u);
  EXPECT_EQ(tasks[0].action, Action::kFollow);
  EXPECT_EQ(tasks[0].owner_address, "b:1");
  const Placement::Listed followed{"site", true, true, 7};
  EXPECT_EQ(placement.Plan(SurveyOf({"a", "b"}, {"site"}, "b"), {followed}, kLater)[0].action,
            Action::kKeep);
  // Another incarnation is loaded anew.
  const Placement::Listed other{"site", true, true, 8};
  EXPECT_EQ(placement.Plan(SurveyOf({"a", "b"}, {"site"}, "b"), {other}, kLater)[0].action,
            Action::kFollow);
}

TEST(PlacementTest, MapWithoutAnOwnerIsTakenByAnyServerAfterAWhile) {
  std::set<Action> at_first, later;
  for (const char* const server : {"a", "b"}) {
    Placement placement(server);
    const Survey survey = SurveyOf({"a", "b"}, {"site"});
    at_first.insert(placement.Plan(survey, {}, absl::ZeroDuration())[0].action);
    later.insert(placement.Plan(survey, {}, Placement::kPatience)[0].action);
  }
  EXPECT_THAT(at_first, ::testing::ElementsAre(Action::kOwn, Action::kFollow));
  EXPECT_THAT(later, ::testing::ElementsAre(Action::kOwn));
}

TEST(PlacementTest, AServerWithoutALeaseTakesNothingAndKeepsWhatItHas) {
  Placement placement("a");
  const Survey survey = SurveyOf({"b"}, {"mine", "other"});
  const Placement::Listed mine{"mine", true, false, 7};
  for (const absl::Duration now : {absl::ZeroDuration(), 2 * Placement::kPatience}) {
    const auto tasks = placement.Plan(survey, {mine}, now);
    ASSERT_EQ(tasks.size(), 2u);
    EXPECT_EQ(tasks[0].action, Action::kKeep);
    EXPECT_EQ(tasks[1].action, Action::kFollow);
  }
}

TEST(PlacementTest, ItIsForeseenWhenALeaseEnds) {
  Placement placement("a");
  Survey survey = SurveyOf({"a", "b", "c"}, {"site"}, "b");
  survey.servers[0].lease_left = absl::Milliseconds(10);  // its own, which it renews
  placement.Plan(survey, {}, absl::ZeroDuration());
  EXPECT_EQ(placement.UntilChange(), absl::InfiniteDuration());
  survey.servers[1].lease_left = absl::Milliseconds(300);
  survey.servers[2].lease_left = absl::Milliseconds(200);
  placement.Plan(survey, {}, absl::ZeroDuration());
  EXPECT_EQ(placement.UntilChange(), absl::Milliseconds(200));
}

TEST(PlacementTest, ItIsForeseenWhenAMapHasBeenWithoutAnOwnerForTooLong) {
  Placement placement("a");
  const Survey survey = SurveyOf({"a", "b"}, {"site"});
  placement.Plan(survey, {}, absl::Seconds(7));
  EXPECT_EQ(placement.UntilChange(), Placement::kPatience);
  placement.Plan(survey, {}, absl::Seconds(7) + Placement::kPatience / 4);
  EXPECT_EQ(placement.UntilChange(), Placement::kPatience * 3 / 4);
  // Then it is taken; what keeps it from being taken can't be foreseen.
  placement.Plan(survey, {}, absl::Seconds(7) + Placement::kPatience);
  EXPECT_EQ(placement.UntilChange(), absl::InfiniteDuration());
}

TEST(PlacementTest, MapsMoveToTheirHomeOnceItHasSettled) {
  const std::vector<std::string> maps = ManyMaps();
  Placement placement("a");
  std::vector<Placement::Listed> owned;
  owned.reserve(maps.size());
  for (const std::string& map : maps) owned.push_back({map, true, false, 7});
  const auto count_moves = [&](const Survey& survey, absl::Duration now) {
    int moves = 0;
    for (const auto& task : placement.Plan(survey, owned, now)) {
      if (task.action == Action::kFollow) ++moves;
    }
    return moves;
  };
  EXPECT_EQ(count_moves(SurveyOf({"a"}, maps, "a"), absl::ZeroDuration()), 0);
  EXPECT_EQ(count_moves(SurveyOf({"a", "b"}, maps, "a"), absl::Seconds(1)), 0);
  EXPECT_EQ(count_moves(SurveyOf({"a", "b"}, maps, "a"), absl::Seconds(3)), 0);
  EXPECT_GT(count_moves(SurveyOf({"a", "b"}, maps, "a"), kLater + absl::Seconds(1)), 400);
  // A server that was away has to settle again.
  EXPECT_EQ(count_moves(SurveyOf({"a"}, maps, "a"), kLater + absl::Seconds(2)), 0);
  EXPECT_EQ(count_moves(SurveyOf({"a", "b"}, maps, "a"), kLater + absl::Seconds(3)), 0);
}

TEST(PlacementTest, MapOfAnEarlierProcessOfThisServerIsTakenAtOnce) {
  for (const char* const server : {"a", "b"}) {
    Placement placement(server);
    EXPECT_EQ(
        placement.Plan(SurveyOf({"a", "b"}, {"site"}, server), {}, absl::ZeroDuration())[0].action,
        Action::kOwn);
  }
}

TEST(PlacementTest, MapWhoseRevisionsTheStoreHasLostIsRenewed) {
  Placement placement("a");
  const Survey survey = SurveyOf({"a"}, {"site"}, "a");  // at revision 3
  const auto plan = [&](const std::vector<Placement::Listed>& listed) {
    return placement.Plan(survey, listed, absl::ZeroDuration())[0];
  };
  EXPECT_EQ(plan({{"site", true, false, 7, 3}}).action, Action::kKeep);
  const Placement::Task lost = plan({{"site", true, false, 7, 5}});
  EXPECT_EQ(lost.action, Action::kRenew);
  EXPECT_EQ(lost.incarnation, 7u);
  EXPECT_EQ(lost.revision, 5);
  // What was shown counts also once the map is closed, and when another session shows less.
  EXPECT_EQ(plan({{"site"}}).action, Action::kRenew);
  EXPECT_EQ(plan({{"site", true, true, 7, 3}}).action, Action::kRenew);
  // Revisions of another incarnation can't be compared.
  EXPECT_EQ(plan({{"site", true, false, 8, 5}}).action, Action::kOwn);
}

// What server "a", which has "site" open as its owner, does with it.
Action ActionOfOwner(const Survey& survey) {
  Placement placement("a");
  return placement.Plan(survey, {{"site", true, false, 7}}, absl::ZeroDuration())[0].action;
}

// What server "a", which has nothing open, does with "site", which has no owner.
Action ActionOfFollower(const Survey& survey) {
  Placement placement("a");
  placement.Plan(survey, {}, absl::ZeroDuration());
  return placement.Plan(survey, {}, 2 * Placement::kPatience)[0].action;
}

TEST(PlacementTest, ServerThatIsDrainedGivesItsMapsAwayAndTakesNone) {
  Survey owned = SurveyOf({"a", "b"}, {"site"}, "a");
  Survey unowned = SurveyOf({"a", "b"}, {"site"});
  owned.servers[0].draining = unowned.servers[0].draining = true;
  EXPECT_EQ(ActionOfOwner(owned), Action::kFollow);
  EXPECT_EQ(ActionOfFollower(unowned), Action::kFollow);
  Placement other("b");
  EXPECT_EQ(other.Plan(unowned, {}, absl::ZeroDuration())[0].action, Action::kOwn);
}

TEST(PlacementTest, ServersThatAreAllDrainedOwnMaps) {
  Survey owned = SurveyOf({"a", "b"}, {"site"}, "a");
  Survey unowned = SurveyOf({"a", "b"}, {"site"});
  for (Survey* const survey : {&owned, &unowned}) {
    for (Survey::Server& server : survey->servers) server.draining = true;
  }
  EXPECT_EQ(ActionOfOwner(owned), Action::kKeep);
  EXPECT_EQ(ActionOfFollower(unowned), Action::kOwn);
}

TEST(PlacementTest, MapsOfADrainedServerGoToOneThatHasNotSettled) {
  Placement placement("a");
  const Placement::Listed owned{"site", true, false, 7};
  Survey survey = SurveyOf({"a"}, {"site"}, "a");
  survey.servers[0].draining = true;
  EXPECT_EQ(placement.Plan(survey, {owned}, absl::ZeroDuration())[0].action, Action::kKeep);
  survey.servers.push_back({"b", "b:1"});
  EXPECT_EQ(placement.Plan(survey, {owned}, absl::Seconds(1))[0].action, Action::kFollow);
}

TEST(PlacementTest, MapThatCouldNotBeGivenBackIsTakenAgain) {
  Placement placement("a");
  Survey survey = SurveyOf({"a", "b"}, {"site"}, "a");
  survey.servers[0].draining = true;
  const Placement::Listed followed{"site", true, true, 7};
  EXPECT_EQ(placement.Plan(survey, {followed}, absl::ZeroDuration())[0].action, Action::kOwn);
}

TEST(PlacementTest, MapThatIsGoneIsForgotten) {
  Placement placement("a");
  const auto tasks =
      placement.Plan(SurveyOf({"a"}, {}), {{"site", true, true, 7}}, absl::ZeroDuration());
  ASSERT_EQ(tasks.size(), 1u);
  EXPECT_EQ(tasks[0].action, Action::kForget);
}

}  // namespace
}  // namespace hypermap::server
