// A map in a database of its own, for tests of single tables.
#ifndef HYPERMAP_STORAGE_POSTGRES_TESTING_WRITTEN_MAP_H_
#define HYPERMAP_STORAGE_POSTGRES_TESTING_WRITTEN_MAP_H_

#include <cstdint>
#include <memory>
#include <string>

#include "gtest/gtest.h"
#include "storage/libpq/testing/cluster.h"
#include "storage/postgres/owned_map.h"
#include "storage/postgres/schema.h"
#include "storage/postgres/testing/database.h"

namespace hypermap::storage::postgres {

// A fixture whose map is empty.
class WrittenMapTest : public ::testing::Test {
 protected:
  void SetUp() override {
    HYPERMAP_SKIP_WITHOUT_POSTGRES();
    database_ = NewDatabase();
    connection_ = Connect(database_);
    ASSERT_TRUE(PrepareSchema(connection_.get()).ok());
    owned_ = AddMap("site");
  }

  std::unique_ptr<OwnedMap> AddMap(const std::string& name) {
    return std::make_unique<OwnedMap>(ConnectOptions{.target = database_},
                                      postgres::AddMap(connection_.get(), name, "server"));
  }

  // Runs a statement with the number of the map as its only parameter.
  Rows Run(const std::string& sql) {
    absl::StatusOr<Rows> rows = connection_->Query(sql, owned_->map());
    EXPECT_TRUE(rows.ok()) << rows.status();
    return rows.ok() ? *std::move(rows) : Rows();
  }

  std::string database_;
  // Another connection than that of the owner.
  std::unique_ptr<Connection> connection_;
  std::unique_ptr<OwnedMap> owned_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_TESTING_WRITTEN_MAP_H_
