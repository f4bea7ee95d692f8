#include "storage/postgres/testing/database.h"

#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "gtest/gtest.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/libpq/testing/cluster.h"
#include "storage/postgres/map_row.h"
#include "storage/postgres/postgres_store.h"
#include "storage/postgres/schema.h"

namespace hypermap::storage::postgres {
namespace {

// The value of a call without which the test can't go on.
template <typename T>
T Need(absl::StatusOr<T> result) {
  EXPECT_TRUE(result.ok()) << result.status();
  return *std::move(result);
}

// The databases of the test that runs, or that ran last.
struct DatabasesOfTest {
  const ::testing::TestInfo* test = nullptr;
  std::vector<std::string> names;
};
DatabasesOfTest& Databases() {
  static auto* const databases = new DatabasesOfTest();
  return *databases;
}

// Each takes some 20 MB and hundreds of files.
void DropDatabasesOfEarlierTests() {
  const ::testing::TestInfo* const now = ::testing::UnitTest::GetInstance()->current_test_info();
  DatabasesOfTest& databases = Databases();
  if (databases.test == now) return;
  for (const std::string& name : databases.names) {
    Cluster::Shared().DropDatabase(name).IgnoreError();
  }
  databases = {now, {}};
}

}  // namespace

std::string NewDatabase() {
  DropDatabasesOfEarlierTests();
  // Copying a database is faster than making the schema.
  static const std::string* const prepared = [] {
    auto* const database = new std::string(Need(Cluster::Shared().CreateDatabase()));
    Need(PrepareSchema(Connect(*database).get()));
    return database;
  }();
  std::string database = Need(Cluster::Shared().CreateDatabase(*prepared));
  Databases().names.push_back(database);
  return database;
}

std::unique_ptr<MapStore> OpenStore(const std::string& database,
                                    const std::string& readers_target) {
  PostgresOptions options;
  options.target = database;
  options.readers_target = readers_target;
  options.server_id = "test";
  options.open_files = [](const std::string& folder) { return OpenGeoPackageStore(folder); };
  return Need(OpenPostgresStore(options));
}

std::unique_ptr<Connection> Connect(const std::string& database) {
  ConnectOptions options;
  options.target = database;
  // Scripts of tests fill tables, on machines that do much else.
  options.response_timeout = absl::Minutes(10);
  return Need(Connection::Open(options));
}

OwnedMap::Row AddMap(Connection* connection, const std::string& name, const std::string& owner) {
  const absl::Status status =
      InsertMap(connection, {.name = name, .frame_id = "map"}, owner, /*last_write=*/1);
  EXPECT_TRUE(status.ok()) << status;
  const MapRow row = *Need(FindMap(connection, name, RowLock::kNone));
  return {row.id, row.epoch, row.last_write};
}

void Execute(const std::string& database, const std::string& sql) {
  const absl::Status status = Connect(database)->Execute(sql);
  ASSERT_TRUE(status.ok()) << status;
}

int64_t QueryNumber(const std::string& database, const std::string& sql) {
  return Need(Connect(database)->QueryInt64(sql)).value_or(0);
}

void EndSessions(const std::string& database) {
  QueryNumber(database,
              "SELECT count(pg_terminate_backend(pid, 10000)) FROM pg_stat_activity "
              "WHERE datname = current_database() AND pid <> pg_backend_pid()");
}

}  // namespace hypermap::storage::postgres
