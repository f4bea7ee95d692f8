// Sites whose database fails over, or is put back to an earlier state, while they run.
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "tests/fleet/fleet_fixture.h"

namespace hypermap::server {
namespace {

using storage::SemanticSpec;
using storage::UnitSquare;
using storage::postgres::Cluster;

class RecoveredFleetTest : public FleetTest {
 protected:
  void SetUp() override {
    HYPERMAP_SKIP_WITHOUT_POSTGRES();
    auto cluster = Cluster::Create();
    ASSERT_TRUE(cluster.ok()) << cluster.status();
    cluster_ = *std::move(cluster);
    database_ = *cluster_->CreateDatabase();
  }

  void MakeMap(const std::string& map) const {
    const auto site = OpenSite("a");
    ASSERT_TRUE(site->Create({map, "map", "make"}).ok());
    ASSERT_TRUE(Edit(*site, map, {{CreateLayer{SemanticSpec("s")}}}).ok());
  }
  void Save() {
    cluster_->Stop(Cluster::StopMode::kFast);
    ASSERT_TRUE(cluster_->SaveFiles().ok());
    ASSERT_TRUE(cluster_->Start().ok());
  }
  // A standby that has all commits takes over, or, after RestoreFiles, one that lacks some.
  void Promote() {
    ASSERT_TRUE(cluster_->RecoverAtStart().ok());
    const absl::Status started = cluster_->Start();
    ASSERT_TRUE(started.ok()) << started;
  }

  // Has commits confirmed, and waits until the sites know it.
  void ConfirmCommits(int64_t num_sites) {
    const absl::Status confirmed = cluster_->ConfirmCommits();
    ASSERT_TRUE(confirmed.ok()) << confirmed;
    for (int i = 0; i < 2; ++i) {
      Execute("CREATE TABLE seen AS SELECT id, lease_until FROM hypermap.servers");
      EXPECT_TRUE(Await([&] {
        const auto renewed = Connect()->QueryInt64(
            "SELECT count(*) FROM hypermap.servers AS s JOIN seen USING (id) "
            "WHERE s.lease_until > seen.lease_until");
        return renewed.ok() && *renewed == num_sites;
      }));
      Execute("DROP TABLE seen");
    }
  }

  // Adds an object by the site that owns the map by then.
  Revision AddObject(const std::vector<Site*>& sites, const std::string& map) {
    absl::StatusOr<storage::Receipt> receipt;
    EXPECT_TRUE(Await([&] {
      for (Site* site : sites) {
        receipt = Edit(*site, map, {{PutObject{"s", UnitSquare("chair"), ""}}});
        if (receipt.ok()) return true;
      }
      return false;
    })) << receipt.status();
    return receipt.ok() ? receipt->revision : 0;
  }

  // Waits while the map changes hands.
  static uint64_t IncarnationAt(Site& site, const std::string& map) {
    uint64_t incarnation = 0;
    EXPECT_TRUE(Await([&] {
      const auto session = site.Find(map);
      if (session.ok()) incarnation = (*session)->incarnation();
      return session.ok();
    })) << map;
    return incarnation;
  }

  std::unique_ptr<Cluster> cluster_;
};

TEST_F(RecoveredFleetTest, MapsStayWhenAStandbyTakesOverThatHasAllCommits) {
  MakeMap("site");
  const auto one = OpenSite("a");
  const auto two = OpenSite("b");
  AwaitMap(*one, "site");
  AwaitMap(*two, "site");
  ASSERT_NO_FATAL_FAILURE(ConfirmCommits(2));
  const Revision before = AddObject({one.get(), two.get()}, "site");
  AwaitRevision(*one, "site", before);
  AwaitRevision(*two, "site", before);
  const uint64_t incarnation = IncarnationAt(*one, "site");

  cluster_->Stop();
  ASSERT_NO_FATAL_FAILURE(Promote());
  const Revision after = AddObject({one.get(), two.get()}, "site");
  EXPECT_EQ(after, before + 1);
  AwaitRevision(*one, "site", after);
  AwaitRevision(*two, "site", after);
  EXPECT_EQ(IncarnationAt(*one, "site"), incarnation);
  EXPECT_EQ(IncarnationAt(*two, "site"), incarnation);
  // A site that starts later finds that the others have seen to it.
  EXPECT_EQ(IncarnationAt(*OpenSite("c"), "site"), incarnation);
}

TEST_F(RecoveredFleetTest, OnlyMapsThatHaveLostRevisionsAreOtherIncarnations) {
  MakeMap("lost");
  MakeMap("kept");
  ASSERT_NO_FATAL_FAILURE(Save());
  const auto one = OpenSite("a");
  const auto two = OpenSite("b");
  for (Site* site : {one.get(), two.get()}) {
    AwaitMap(*site, "lost");
    AwaitMap(*site, "kept");
  }
  ASSERT_NO_FATAL_FAILURE(ConfirmCommits(2));
  const Revision shown = AddObject({one.get(), two.get()}, "lost");
  ASSERT_EQ(shown, 2);
  const uint64_t lost = IncarnationAt(*one, "lost");
  const uint64_t kept = IncarnationAt(*one, "kept");
  AwaitRevision(*one, "lost", shown);
  AwaitRevision(*two, "lost", shown);

  // The database is put back to an earlier point, whatever was confirmed since.
  cluster_->Stop();
  ASSERT_TRUE(cluster_->RestoreFiles().ok());
  ASSERT_NO_FATAL_FAILURE(Promote());
  EXPECT_TRUE(Await([&] {
    const uint64_t now = IncarnationAt(*one, "lost");
    return now != lost && now == IncarnationAt(*two, "lost");
  }));
  EXPECT_EQ(AddObject({one.get(), two.get()}, "lost"), 2);
  EXPECT_EQ(AddObject({one.get(), two.get()}, "kept"), 2);
  EXPECT_EQ(IncarnationAt(*one, "kept"), kept);
  EXPECT_EQ(IncarnationAt(*two, "kept"), kept);
}

TEST_F(RecoveredFleetTest, AllMapsAreOtherIncarnationsIfNoStandbyConfirmedTheirCommits) {
  MakeMap("site");
  const auto site = OpenSite("a");
  const uint64_t before = IncarnationAt(*site, "site");
  cluster_->Stop();
  ASSERT_NO_FATAL_FAILURE(Promote());
  EXPECT_TRUE(Await([&] { return IncarnationAt(*site, "site") != before; }));
  EXPECT_EQ(AddObject({site.get()}, "site"), 2);
}

}  // namespace
}  // namespace hypermap::server
