// Connections through pgbouncer, which hands its few sessions from transaction to transaction.
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/libpq/connection.h"
#include "storage/libpq/testing/database_test.h"
#include "storage/libpq/testing/pgbouncer.h"

namespace hypermap::storage::postgres {
namespace {

using ::testing::HasSubstr;

class PooledTest : public DatabaseTest {
 protected:
  static constexpr int kSessions = 2;

  void SetUp() override {
    HYPERMAP_SKIP_WITHOUT_PGBOUNCER();
    DatabaseTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    ASSERT_EQ(connection_->Execute("CREATE TABLE t (a bigint PRIMARY KEY, b text)"),
              absl::OkStatus());
    auto pgbouncer = Pgbouncer::Start(Cluster::Shared(), kSessions);
    ASSERT_TRUE(pgbouncer.ok()) << pgbouncer.status();
    pgbouncer_ = *std::move(pgbouncer);
    options_.target = pgbouncer_->Through(options_.target);
    options_.prepares = false;
  }

  std::unique_ptr<Pgbouncer> pgbouncer_;
};

TEST_F(PooledTest, ManyConnectionsShareSessions) {
  std::vector<std::unique_ptr<Connection>> connections;
  for (int i = 0; i < 10; ++i) connections.push_back(Connect());
  for (int round = 0; round < 5; ++round) {
    for (size_t i = 0; i < connections.size(); ++i) {
      Connection& connection = *connections[i];
      const int64_t id = round * 100 + static_cast<int64_t>(i);
      ASSERT_TRUE(connection.Query("INSERT INTO t VALUES ($1, $2)", id, "text").ok());
      Pipeline pipeline(&connection);
      pipeline.Add("BEGIN");
      pipeline.Add("UPDATE t SET b = $1 WHERE a = $2", absl::StrCat("text ", id), id);
      pipeline.Add("COMMIT");
      ASSERT_EQ(pipeline.Finish(), absl::OkStatus());
      auto snapshot = Transaction::Begin(&connection, Transaction::Kind::kSnapshot);
      ASSERT_TRUE(snapshot.ok());
      auto rows = connection.Query("SELECT b FROM t WHERE a = $1", id);
      ASSERT_TRUE(rows.ok() && rows->Next());
      EXPECT_EQ(rows->Text(0), absl::StrCat("text ", id));
      EXPECT_EQ(snapshot->Commit(), absl::OkStatus());
    }
  }
  const auto sessions = connection_->QueryInt64(
      "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() "
      "AND pid <> pg_backend_pid()");
  EXPECT_LE(**sessions, kSessions);
}

TEST_F(PooledTest, ErrorsLeaveTheSessionUsable) {
  const auto connection = Connect();
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(SqlStateOf(connection->Query("SELECT 1 / $1", 0).status()), "22012");
    Pipeline pipeline(connection.get());
    pipeline.Add("BEGIN");
    pipeline.Add("INSERT INTO t VALUES ($1, $2)", i, "text");
    pipeline.Add("SELECT 1 / $1", 0);
    pipeline.Add("COMMIT");
    EXPECT_EQ(SqlStateOf(pipeline.Finish()), "22012");
    EXPECT_FALSE(connection->is_in_transaction());
  }
  EXPECT_EQ(**connection->QueryInt64("SELECT count(*) FROM t"), 0);
}

TEST_F(PooledTest, StatementsAreCancelled) {
  const auto connection = Connect();
  for (int i = 0; i < 3; ++i) {
    CancelledAfter cancelled(5);
    EXPECT_TRUE(absl::IsCancelled(connection->Query("SELECT pg_sleep(60)").status()));
    const ScopedCancellation none(nullptr);
    EXPECT_FALSE(connection->is_broken());
    EXPECT_EQ(**connection->QueryInt64("SELECT 7::bigint"), 7);
  }
}

TEST_F(PooledTest, SessionsOfOnesOwnAreRefused) {
  options_.prepares = true;
  const absl::Status status = Connection::Open(options_).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr("unsupported startup parameter: options"));
}

}  // namespace
}  // namespace hypermap::storage::postgres
