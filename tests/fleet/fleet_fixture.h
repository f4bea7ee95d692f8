// Sites that share a database of the test's own.
#ifndef HYPERMAP_TESTS_FLEET_FLEET_FIXTURE_H_
#define HYPERMAP_TESTS_FLEET_FLEET_FIXTURE_H_

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "gtest/gtest.h"
#include "server/session/site.h"
#include "storage/decorators/metered_store.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/libpq/connection.h"
#include "storage/libpq/testing/cluster.h"
#include "storage/postgres/postgres_store.h"

namespace hypermap::server {

inline constexpr absl::Duration kDeadline = absl::Seconds(60);
inline constexpr absl::Duration kLease = absl::Seconds(2);

class FleetTest : public ::testing::Test {
 protected:
  void SetUp() override {
    HYPERMAP_SKIP_WITHOUT_POSTGRES();
    database_ = *storage::postgres::Cluster::Shared().CreateDatabase();
  }

  std::unique_ptr<storage::MapStore> OpenStore(const std::string& id) const {
    storage::PostgresOptions options;
    options.target = database_;
    options.server_id = id;
    options.lease = kLease;
    options.open_files = [](const std::string& folder) {
      return storage::OpenGeoPackageStore(folder);
    };
    auto store = storage::OpenPostgresStore(options);
    EXPECT_TRUE(store.ok()) << store.status();
    // As in hypermapd.
    static storage::StoreMeters meters;
    return storage::MakeMeteredStore(*std::move(store), &meters);
  }

  std::unique_ptr<Site> OpenSite(const std::string& id, const SessionOptions& session = {}) const {
    auto site = Site::Open(OpenStore(id), session);
    EXPECT_TRUE(site.ok()) << site.status();
    (*site)->Advertise(absl::StrCat(id, ":1"));
    return *std::move(site);
  }

  static bool Await(const std::function<bool()>& holds) {
    const absl::Time deadline = absl::Now() + kDeadline;
    while (!holds()) {
      if (absl::Now() > deadline) return false;
      absl::SleepFor(absl::Milliseconds(5));
    }
    return true;
  }
  static std::shared_ptr<MapSession> AwaitMap(Site& site, const std::string& map) {
    EXPECT_TRUE(Await([&] { return site.Find(map).ok(); })) << map;
    return *site.Find(map);
  }
  static bool IsOwner(Site& site, const std::string& map) {
    const auto session = site.Find(map);
    return session.ok() && !(*session)->is_follower();
  }
  static void AwaitRevision(Site& site, const std::string& map, Revision revision) {
    EXPECT_TRUE(Await([&] {
      const auto session = site.Find(map);
      return session.ok() && (*session)->snapshot()->revision >= revision;
    })) << "revision "
        << revision;
  }
  static absl::StatusOr<storage::Receipt> Edit(Site& site, const std::string& map,
                                               const EditBatch& batch,
                                               const std::string& request_id = "") {
    auto session = site.Find(map);
    if (!session.ok()) return session.status();
    return (*session)->SubmitAndWait({batch, "tester", request_id});
  }

  // A connection to the database, without any server.
  std::unique_ptr<storage::postgres::Connection> Connect() const {
    storage::postgres::ConnectOptions options;
    options.target = database_;
    auto connection = storage::postgres::Connection::Open(options);
    EXPECT_TRUE(connection.ok()) << connection.status();
    return *std::move(connection);
  }
  void Execute(const std::string& statement) const {
    const absl::Status status = Connect()->Execute(statement);
    ASSERT_TRUE(status.ok()) << status;
  }

  std::string database_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_TESTS_FLEET_FLEET_FIXTURE_H_
