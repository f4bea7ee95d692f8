// Sites that share a database: each map has one owner, and all sites show it.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/rpc/revision_wait.h"
#include "server/session/comparison_schedule.h"
#include "server/session/not_owner.h"
#include "server/watch/watch_source.h"
#include "storage/conformance/testing/edited_map.h"
#include "tests/fleet/fleet_fixture.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

using storage::ExpectSame;
using storage::SemanticSpec;
using storage::UnitSquare;

// Runs no loops: a follower stays at the revision at which it was opened.
class StillExecutor : public Executor {
 public:
  SteadyTime Now() const override { return SteadyTime::Now(); }
  absl::StatusOr<std::unique_ptr<Running>> Start(ThreadName /*name*/, Step /*step*/) override {
    return std::make_unique<StillLoop>();
  }

 private:
  class StillLoop : public Running {
   public:
    void Wake() override {}
    void Join() override {}
  };
};

TEST_F(FleetTest, FollowerShowsWhatTheOwnerShows) {
  const auto owner = OpenSite("a");
  ASSERT_TRUE(owner->Create({"site", "map", "make"}).ok());
  ASSERT_TRUE(Edit(*owner, "site", {{CreateLayer{SemanticSpec("s")}}}).ok());
  const auto follower = OpenSite("b");
  const std::shared_ptr<MapSession> followed = AwaitMap(*follower, "site");
  EXPECT_TRUE(followed->is_follower());
  EXPECT_EQ(followed->incarnation(), (*owner->Find("site"))->incarnation());
  const Revision from = followed->snapshot()->revision;
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(Edit(*owner, "site", {{PutObject{"s", UnitSquare("chair"), ""}}}).ok());
  }
  AwaitRevision(*follower, "site", 51);
  ExpectSame(*followed->snapshot(), *(*owner->Find("site"))->snapshot());
  EXPECT_EQ(followed->snapshot()->layer_versions,
            (*owner->Find("site"))->snapshot()->layer_versions);
  // Watches of the follower get each revision once, in order.
  const auto commits = followed->feed().Read(from, 1000);
  ASSERT_TRUE(commits.has_value());
  ASSERT_EQ(commits->size(), 51u - from);
  for (size_t i = 0; i < commits->size(); ++i) {
    EXPECT_EQ((*commits)[i].revision, from + 1 + static_cast<Revision>(i));
    EXPECT_EQ((*commits)[i].author, "tester");
  }
  // The past is read from the same store.
  const auto history = followed->OpenHistory();
  ASSERT_TRUE(history.ok()) << history.status();
  EXPECT_EQ((*(*history)->At(20))->structure()->revision, 20);
}

// The revision that a linearizable question to the site is answered from.
absl::StatusOr<Revision> AskLinearizable(Site& site, const std::string& map) {
  Facilities facilities{};
  facilities.site = &site;
  v1::Scope scope;
  scope.set_map(map);
  v1::AsOf as_of;
  as_of.set_consistency(v1::CONSISTENCY_LINEARIZABLE);
  RevisionWait wait;
  std::promise<absl::StatusOr<Revision>> reached;
  std::future<absl::StatusOr<Revision>> ended = reached.get_future();
  wait.Start(facilities, scope, as_of,
             [&](const absl::StatusOr<Revision>& least) { reached.set_value(least); });
  if (ended.wait_for(absl::ToChronoMilliseconds(kDeadline)) != std::future_status::ready) {
    wait.Stop();
  }
  HYPERMAP_RETURN_IF_ERROR(ended.get().status());
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session, site.Find(map));
  return session->snapshot()->revision;
}

TEST_F(FleetTest, LinearizableQuestionAtAFollowerShowsWhatTheOwnerHasAcknowledged) {
  constexpr int kEdits = 1000;
  auto owner = OpenSite("a");
  ASSERT_TRUE(owner->Create({"site", "map", "make"}).ok());
  ASSERT_TRUE(Edit(*owner, "site", {{CreateLayer{SemanticSpec("s")}}}).ok());
  auto follower = OpenSite("b");
  AwaitMap(*follower, "site");
  int num_late = 0;
  for (int i = 0; i < kEdits; ++i) {
    absl::StatusOr<storage::Receipt> receipt;
    // The map may change hands.
    ASSERT_TRUE(Await([&] {
      if (!IsOwner(*owner, "site")) std::swap(owner, follower);
      receipt = Edit(*owner, "site", {{PutObject{"s", UnitSquare("chair"), ""}}});
      return !absl::IsUnavailable(receipt.status());
    }));
    ASSERT_TRUE(receipt.ok()) << receipt.status();
    const auto followed = follower->Find("site");
    if (followed.ok() && (*followed)->snapshot()->revision < receipt->revision) ++num_late;
    absl::StatusOr<Revision> shown;
    ASSERT_TRUE(Await([&] {
      shown = AskLinearizable(*follower, "site");
      return !absl::IsUnavailable(shown.status());
    }));
    ASSERT_TRUE(shown.ok()) << shown.status();
    ASSERT_GE(*shown, receipt->revision);
  }
  // Otherwise a question that does not wait would have passed, too.
  EXPECT_GT(num_late, 0);
}

TEST_F(FleetTest, LinearizableQuestionIsNotAnsweredFromADeletedMap) {
  const auto owner = OpenSite("a");
  ASSERT_TRUE(owner->Create({"site", "map", "make"}).ok());
  const auto follower = OpenSite("b");
  AwaitMap(*follower, "site");
  ASSERT_TRUE(owner->Delete("site", "delete").ok());
  EXPECT_EQ(AskLinearizable(*follower, "site").status().code(), absl::StatusCode::kNotFound);
  ASSERT_TRUE(owner->Create({"site", "map", "anew"}).ok());
  // Until it has found the new map.
  absl::StatusOr<Revision> shown;
  EXPECT_TRUE(Await([&] {
    shown = AskLinearizable(*follower, "site");
    EXPECT_TRUE(shown.ok() || absl::IsUnavailable(shown.status())) << shown.status();
    return shown.ok();
  }));
  EXPECT_EQ((*follower->Find("site"))->incarnation(), (*owner->Find("site"))->incarnation());
}

TEST_F(FleetTest, WatchThatIsAheadOfAFollowerComesAgain) {
  const auto owner = OpenSite("a");
  ASSERT_TRUE(owner->Create({"site", "map", "make"}).ok());
  StillExecutor still;
  SessionOptions options;
  options.executor = &still;
  const auto follower = OpenSite("b", options);
  ASSERT_TRUE(Edit(*owner, "site", {{CreateLayer{SemanticSpec("s")}}}).ok());
  ASSERT_EQ((*follower->Find("site"))->snapshot()->revision, 0);
  Facilities facilities{};
  facilities.site = follower.get();
  const WatchTuning tuning;
  WatchGroups groups{Limits()};
  v1::WatchRequest request;
  request.mutable_scope()->set_map("site");
  const auto resume = [&](Revision revision) {
    request.set_start_revision(revision);
    return WatchSource::Open(facilities, tuning, &groups, request).status().code();
  };
  EXPECT_EQ(resume(0), absl::StatusCode::kOk);
  EXPECT_EQ(resume(1), absl::StatusCode::kUnavailable);
  EXPECT_EQ(resume(2), absl::StatusCode::kOutOfRange);
}

TEST_F(FleetTest, FollowerTellsWhoWritesTheMap) {
  const auto owner = OpenSite("a");
  ASSERT_TRUE(owner->Create({"site", "map", "make"}).ok());
  const auto follower = OpenSite("b");
  AwaitMap(*follower, "site");
  std::optional<std::string> address;
  EXPECT_TRUE(Await([&] {
    const absl::Status status =
        Edit(*follower, "site", {{CreateLayer{SemanticSpec("s")}}}).status();
    EXPECT_TRUE(absl::IsUnavailable(status)) << status;
    address = OwnerAddressOf(status);
    return address.has_value();
  }));
  EXPECT_EQ(address, "a:1");
  EXPECT_EQ((*owner->Find("site"))->snapshot()->revision, 0);
}

TEST_F(FleetTest, MapThatIsKeptWhileItIsClosedIsOpenedByItsOwnerOnly) {
  const auto owner = OpenStore("a");
  const auto other = OpenStore("b");
  auto map = owner->Create({"site", "map"});
  ASSERT_TRUE(map.ok()) << map.status();
  (*map)->KeepOwnership();
  map->reset();
  EXPECT_EQ(other->Open("site").status().code(), absl::StatusCode::kFailedPrecondition);
  map = owner->Open("site");
  ASSERT_TRUE(map.ok()) << map.status();
  map->reset();
  EXPECT_TRUE(other->Open("site").ok());
}

TEST_F(FleetTest, ARestoredMapIsOpenedByTheServerThatRestoredItOnly) {
  const testing::TemporaryFolder folder;
  const std::string file = folder / "backup";
  const auto files = storage::OpenGeoPackageStore(folder / "maps");
  ASSERT_TRUE(files.ok()) << files.status();
  auto map = (*files)->Create({"site", "map"});
  ASSERT_TRUE(map.ok()) << map.status();
  ASSERT_EQ((*map)->BackupTo(file), absl::OkStatus());
  const auto owner = OpenStore("a");
  const auto other = OpenStore("b");
  ASSERT_EQ(owner->Restore(file, "site", "restore"), absl::OkStatus());
  EXPECT_EQ(other->Open("site").status().code(), absl::StatusCode::kFailedPrecondition);
  map = owner->Open("site");
  ASSERT_TRUE(map.ok()) << map.status();
  map->reset();
  EXPECT_TRUE(other->Open("site").ok());
}

TEST_F(FleetTest, MapOfASiteThatClosesIsTakenOver) {
  auto owner = OpenSite("a");
  ASSERT_TRUE(owner->Create({"site", "map", "make"}).ok());
  ASSERT_TRUE(Edit(*owner, "site", {{CreateLayer{SemanticSpec("s")}}}, "first").ok());
  const auto follower = OpenSite("b");
  AwaitMap(*follower, "site");
  owner.reset();
  ASSERT_TRUE(Await([&] { return IsOwner(*follower, "site"); }));
  // A request that the former owner has carried out is answered as it was.
  const auto again = Edit(*follower, "site", {{CreateLayer{SemanticSpec("s")}}}, "first");
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->revision, 1);
  const auto next = Edit(*follower, "site", {{PutObject{"s", UnitSquare("chair"), ""}}});
  ASSERT_TRUE(next.ok()) << next.status();
  EXPECT_EQ(next->revision, 2);
}

TEST_F(FleetTest, ASurveyTellsHowLongLeasesLast) {
  const auto site = OpenSite("a");
  Execute(
      "INSERT INTO hypermap.servers (id, address, session, lease_until) VALUES "
      "('gone', '', 1, now() - interval '1 second'), "
      "('long', '', 1, now() + interval '1 hour')");
  const absl::StatusOr<storage::Survey> survey = site->TakeSurvey();
  ASSERT_TRUE(survey.ok()) << survey.status();
  ASSERT_EQ(survey->servers.size(), 2u);
  EXPECT_EQ(survey->servers[0].id, "a");
  EXPECT_GT(survey->servers[0].lease_left, absl::ZeroDuration());
  EXPECT_LE(survey->servers[0].lease_left, kLease);
  EXPECT_FALSE(survey->servers[0].draining);
  EXPECT_EQ(survey->servers[1].id, "long");
  EXPECT_GT(survey->servers[1].lease_left, absl::Minutes(50));
  EXPECT_LE(survey->servers[1].lease_left, absl::Hours(1));
}

TEST_F(FleetTest, MapsOfASiteThatDiesAreTakenOver) {
  constexpr int kMaps = 20;
  const auto site = OpenSite("a");
  for (int i = 0; i < kMaps; ++i) {
    ASSERT_TRUE(site->Create({absl::StrCat("map-", i), "map", "make"}).ok());
  }
  const auto other = OpenSite("b");
  AwaitMap(*other, absl::StrCat("map-", kMaps - 1));
  // Both of them follow a third server, which renews its lease no more.
  Execute(
      "INSERT INTO hypermap.servers (id, address, session, lease_until) VALUES "
      "('c', 'c:1', 1, clock_timestamp() + interval '3 seconds'); "
      "UPDATE hypermap.maps SET owner = 'c', epoch = epoch + 1");
  EXPECT_TRUE(Await([&] {
    int owned = 0;
    for (int i = 0; i < kMaps; ++i) {
      const std::string map = absl::StrCat("map-", i);
      owned += IsOwner(*site, map) != IsOwner(*other, map) ? 1 : 0;
    }
    const auto written =
        Connect()->QueryInt64("SELECT count(*) FROM hypermap.maps WHERE owner <> 'c'");
    return owned == kMaps && written.ok() && *written == kMaps;
  }));
}

TEST_F(FleetTest, AReplacedOwnerRefusesNoEdits) {
  const auto site = OpenSite("a");
  ASSERT_TRUE(site->Create({"site", "map", "make"}).ok());
  ASSERT_TRUE(Edit(*site, "site", {{CreateLayer{SemanticSpec("s")}}}).ok());
  const EditBatch refused{{DeleteLayer{"other"}}};
  EXPECT_EQ(Edit(*site, "site", refused).status().code(), absl::StatusCode::kNotFound);
  // Another server takes the map over, as if this one had been frozen.
  Execute("UPDATE hypermap.maps SET owner = 'b', epoch = epoch + 1");
  // It may have made the layer.
  EXPECT_EQ(Edit(*site, "site", refused).status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(FleetTest, WhatIsShownOtherwiseThanItIsStoredIsFoundAndLoadedAgain) {
  const auto owner = OpenSite("a");
  ASSERT_TRUE(owner->Create({"site", "map", "make"}).ok());
  ASSERT_TRUE(Edit(*owner, "site", {{CreateLayer{SemanticSpec("s")}}}).ok());
  ASSERT_TRUE(Edit(*owner, "site", {{CreateLayer{SemanticSpec("other")}}}).ok());
  ASSERT_TRUE(Edit(*owner, "site", {{PutObject{"s", UnitSquare("chair"), ""}}}).ok());
  const auto follower = OpenSite("b");
  AwaitMap(*follower, "site");
  AwaitRevision(*follower, "site", 3);
  for (Site* site : {owner.get(), follower.get()}) {
    const auto compared = site->CompareWithStore(**site->Find("site"));
    ASSERT_TRUE(compared.ok()) << compared.status();
    EXPECT_THAT(compared->differing, IsEmpty());
  }
  Execute("UPDATE hypermap.objects SET label = 'sofa'");
  for (Site* site : {owner.get(), follower.get()}) {
    const auto compared = site->CompareWithStore(**site->Find("site"));
    ASSERT_TRUE(compared.ok()) << compared.status();
    EXPECT_EQ(compared->revision, 3);
    EXPECT_THAT(compared->differing, ElementsAre("s"));
  }

  const auto shows = [](Site& site, const std::string& label) {
    const auto session = site.Find("site");
    if (!session.ok()) return false;
    const SnapshotPtr snapshot = (*session)->snapshot();
    return snapshot->FindSemantic("s")->Objects().front()->label == label;
  };
  std::vector<std::unique_ptr<ComparisonSchedule>> schedules;
  for (Site* site : {follower.get(), owner.get()}) {
    schedules.push_back(*ComparisonSchedule::Start(site, absl::Milliseconds(20)));
  }
  const auto sum = [&](int64_t ComparisonMeters::OfMap::*count) {
    int64_t total = 0;
    for (const auto& schedule : schedules) total += schedule->meters().Read()["site"].*count;
    return total;
  };
  // If the map changes hands meanwhile, one of them loads it for that reason.
  EXPECT_TRUE(Await([&] { return shows(*owner, "sofa") && shows(*follower, "sofa"); }));
  EXPECT_GE(sum(&ComparisonMeters::OfMap::different), 1);
  const int64_t equal = sum(&ComparisonMeters::OfMap::equal);
  EXPECT_TRUE(Await([&] { return sum(&ComparisonMeters::OfMap::equal) > equal; }));
  // One of them owns the map, and it can be edited as before.
  EXPECT_TRUE(Await([&] {
    return Edit(*owner, "site", {{PutObject{"s", UnitSquare("cup"), ""}}}).ok() ||
           Edit(*follower, "site", {{PutObject{"s", UnitSquare("cup"), ""}}}).ok();
  }));
}

TEST_F(FleetTest, AReplacedOwnerTakesTheMapAgain) {
  const auto site = OpenSite("a");
  ASSERT_TRUE(site->Create({"site", "map", "make"}).ok());
  ASSERT_TRUE(Edit(*site, "site", {{CreateLayer{SemanticSpec("s")}}}).ok());
  // Another server has had the map in between.
  Execute("UPDATE hypermap.maps SET owner = NULL, epoch = epoch + 1");
  EXPECT_TRUE(Await([&] {
    const auto edited = Edit(*site, "site", {{PutObject{"s", UnitSquare("chair"), ""}}});
    EXPECT_TRUE(edited.ok() || absl::IsUnavailable(edited.status())) << edited.status();
    return edited.ok() || !absl::IsUnavailable(edited.status());
  }));
}

TEST_F(FleetTest, AnIdleOwnerTakesTheMapAgainOnceItIsAnotherIncarnation) {
  const auto site = OpenSite("a");
  ASSERT_TRUE(site->Create({"site", "map", "make"}).ok());
  ASSERT_TRUE(Edit(*site, "site", {{CreateLayer{SemanticSpec("s")}}}).ok());
  const auto before = *site->Find("site");
  Execute("UPDATE hypermap.maps SET incarnation = 7, owner = NULL, epoch = epoch + 1");
  EXPECT_TRUE(Await([&] {
    const auto session = site->Find("site");
    return session.ok() && (*session)->incarnation() == 7;
  }));
  // Watches are told that they have to begin anew.
  EXPECT_TRUE(before->feed().closed());
  EXPECT_TRUE(Edit(*site, "site", {{PutObject{"s", UnitSquare("chair"), ""}}}).ok());
}

TEST_F(FleetTest, MapsThatAreMadeAndDeletedElsewhereComeAndGo) {
  const auto one = OpenSite("a");
  const auto other = OpenSite("b");
  ASSERT_TRUE(one->Create({"site", "map", "make"}).ok());
  AwaitMap(*other, "site");
  // ABORTED while a site is at opening or closing the map.
  absl::Status created;
  EXPECT_TRUE(Await([&] {
    created = other->Create({"site", "map", "other"}).status();
    return !absl::IsAborted(created);
  }));
  EXPECT_EQ(created.code(), absl::StatusCode::kAlreadyExists);
  ASSERT_TRUE(Await([&] { return one->Delete("site", "delete").ok(); }));
  EXPECT_TRUE(Await([&] { return absl::IsNotFound(other->Find("site").status()); }));
  // A new map of the name is another incarnation.
  // The other site may still be at forgetting the map.
  ASSERT_TRUE(Await([&] { return other->Create({"site", "map", "anew"}).ok(); }));
  AwaitMap(*one, "site");
  EXPECT_EQ((*one->Find("site"))->incarnation(), (*other->Find("site"))->incarnation());
}

int CountOwned(const Site& site) {
  const std::vector<Site::Entry> maps = site.List();
  return static_cast<int>(std::count_if(maps.begin(), maps.end(), [](const Site::Entry& map) {
    return map.session != nullptr && !map.session->is_follower();
  }));
}

TEST_F(FleetTest, ADrainedSiteOwnsNoMaps) {
  constexpr int kMaps = 12;
  const auto first = OpenSite("a");
  for (int i = 0; i < kMaps; ++i) {
    ASSERT_TRUE(first->Create({absl::StrCat("map-", i), "map", "make"}).ok());
  }
  const auto second = OpenSite("b");
  ASSERT_EQ(second->SetDraining("a", true), absl::OkStatus());
  EXPECT_TRUE(Await([&] { return CountOwned(*second) == kMaps && CountOwned(*first) == 0; }));
  // One that is made there is given away as well.
  ASSERT_TRUE(first->Create({"new", "map", "make"}).ok());
  EXPECT_TRUE(Await([&] { return IsOwner(*second, "new") && !IsOwner(*first, "new"); }));
  ASSERT_EQ(first->SetDraining("a", false), absl::OkStatus());
  EXPECT_TRUE(Await([&] { return CountOwned(*first) > 1; }));
}

// Each site shows all that was acknowledged there, and nothing older than before.
TEST_F(FleetTest, WhatASiteShowsNeverGoesBackWhenTheMapChangesHands) {
  const auto first = OpenSite("a");
  const auto second = OpenSite("b");
  ASSERT_TRUE(first->Create({"site", "map", "make"}).ok());
  ASSERT_TRUE(Edit(*first, "site", {{CreateLayer{SemanticSpec("s")}}}).ok());
  AwaitMap(*second, "site");
  std::atomic<bool> is_over = false;
  const auto write_and_look = [&is_over](Site* site) {
    Revision seen = 0;
    while (!is_over) {
      const auto receipt = Edit(*site, "site", {{PutObject{"s", UnitSquare("chair"), ""}}});
      if (receipt.ok()) seen = std::max(seen, receipt->revision);
      const auto session = site->Find("site");
      if (!session.ok()) continue;
      const Revision shown = (*session)->snapshot()->revision;
      EXPECT_GE(shown, seen);
      seen = shown;
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back(write_and_look, i % 2 == 0 ? first.get() : second.get());
  }
  for (int move = 0; move < 6; ++move) {
    const bool from_first = IsOwner(*first, "site");
    const std::string from = from_first ? "a" : "b";
    EXPECT_EQ(first->SetDraining(from, true), absl::OkStatus());
    EXPECT_TRUE(Await([&] { return IsOwner(from_first ? *second : *first, "site"); }));
    EXPECT_EQ(first->SetDraining(from, false), absl::OkStatus());
  }
  is_over = true;
  for (std::thread& thread : threads) thread.join();
}

TEST_F(FleetTest, ASiteThatIsOpenedAnewIsNotDrained) {
  const auto site = OpenSite("a");
  const auto is_draining = [&] {
    const absl::StatusOr<storage::Survey> survey = site->TakeSurvey();
    EXPECT_TRUE(survey.ok()) << survey.status();
    return survey.ok() && survey->servers.at(0).draining;
  };
  ASSERT_EQ(site->SetDraining("a", true), absl::OkStatus());
  EXPECT_TRUE(is_draining());
  // As if the process had been killed, which leaves its row.
  const auto later = OpenSite("a");
  EXPECT_FALSE(is_draining());
}

TEST_F(FleetTest, OnlySitesThatLiveAreDrained) {
  const auto site = OpenSite("a");
  Execute(
      "INSERT INTO hypermap.servers (id, address, session, lease_until) VALUES "
      "('gone', '', 1, now() - interval '1 second')");
  EXPECT_EQ(site->SetDraining("gone", true).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(site->SetDraining("other", true).code(), absl::StatusCode::kNotFound);
}

TEST_F(FleetTest, MapsAreSharedOutAmongTheSites) {
  constexpr int kMaps = 12;
  const auto first = OpenSite("a");
  for (int i = 0; i < kMaps; ++i) {
    const std::string map = absl::StrCat("map-", i);
    ASSERT_TRUE(first->Create({map, "map", "make"}).ok());
    ASSERT_TRUE(Edit(*first, map, {{CreateLayer{SemanticSpec("s")}}}).ok());
  }
  const auto second = OpenSite("b");
  EXPECT_TRUE(Await([&] {
    const int owned = CountOwned(*second);
    return owned > 1 && CountOwned(*first) == kMaps - owned;
  }));
  // Each map is written by one of them, and shown by both.
  for (int i = 0; i < kMaps; ++i) {
    const std::string map = absl::StrCat("map-", i);
    Site& owner = IsOwner(*first, map) ? *first : *second;
    ASSERT_TRUE(Edit(owner, map, {{PutObject{"s", UnitSquare("chair"), ""}}}).ok());
    AwaitRevision(*first, map, 2);
    AwaitRevision(*second, map, 2);
  }
}

}  // namespace
}  // namespace hypermap::server
