// A test with an empty database of its own.
#ifndef HYPERMAP_STORAGE_LIBPQ_TESTING_DATABASE_TEST_H_
#define HYPERMAP_STORAGE_LIBPQ_TESTING_DATABASE_TEST_H_

#include <memory>
#include <string>
#include <utility>

#include "gtest/gtest.h"
#include "storage/libpq/connection.h"
#include "storage/libpq/testing/cluster.h"

namespace hypermap::storage::postgres {

class DatabaseTest : public ::testing::Test {
 protected:
  void SetUp() override {
    HYPERMAP_SKIP_WITHOUT_POSTGRES();
    const absl::StatusOr<std::string> target = Cluster::Shared().CreateDatabase();
    ASSERT_TRUE(target.ok()) << target.status();
    options_.target = database_ = *target;
    connection_ = Connect();
  }

  void TearDown() override {
    connection_ = nullptr;
    if (!database_.empty()) {
      EXPECT_EQ(Cluster::Shared().DropDatabase(database_), absl::OkStatus());
    }
  }

  // Another connection with the options, which a test may change before.
  std::unique_ptr<Connection> Connect() const {
    auto connection = Connection::Open(options_);
    EXPECT_TRUE(connection.ok()) << connection.status();
    return connection.ok() ? *std::move(connection) : nullptr;
  }

  std::string database_;  // its connection string
  ConnectOptions options_;
  std::unique_ptr<Connection> connection_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_TESTING_DATABASE_TEST_H_
