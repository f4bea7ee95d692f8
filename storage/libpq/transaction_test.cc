#include "storage/libpq/transaction.h"

#include <utility>

#include "base/cancellation/testing/cancelled_after.h"
#include "gtest/gtest.h"
#include "storage/libpq/connection.h"
#include "storage/libpq/testing/database_test.h"
#include "tests/support/eventually.h"

namespace hypermap::storage::postgres {
namespace {

class TransactionTest : public DatabaseTest {
 protected:
  void SetUp() override {
    DatabaseTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    ASSERT_EQ(connection_->Execute("CREATE TABLE t (a bigint PRIMARY KEY)"), absl::OkStatus());
  }
  static int64_t CountBy(Connection& connection) {
    return **connection.QueryInt64("SELECT count(*) FROM t");
  }
  // As another connection sees them.
  int64_t Count() const { return CountBy(*Connect()); }
  void Insert(int64_t a) {
    EXPECT_EQ(connection_->Query("INSERT INTO t VALUES ($1)", a).status(), absl::OkStatus());
  }
};

TEST_F(TransactionTest, IsRolledBackUnlessCommitted) {
  {
    const auto transaction = Transaction::Begin(connection_.get());
    Insert(1);
    EXPECT_EQ(CountBy(*connection_), 1);
    EXPECT_TRUE(connection_->is_in_transaction());
  }
  EXPECT_EQ(Count(), 0);
  EXPECT_FALSE(connection_->is_in_transaction());
  auto transaction = Transaction::Begin(connection_.get());
  Transaction moved = *std::move(transaction);
  Insert(1);
  ASSERT_EQ(moved.Commit(), absl::OkStatus());
  EXPECT_EQ(Count(), 1);
}

TEST_F(TransactionTest, SnapshotSeesOneStateAndWritesNothing) {
  auto snapshot = Transaction::Begin(connection_.get(), Transaction::Kind::kSnapshot);
  EXPECT_EQ(CountBy(*connection_), 0);
  ASSERT_EQ(Connect()->Execute("INSERT INTO t VALUES (1)"), absl::OkStatus());
  EXPECT_EQ(CountBy(*connection_), 0);
  const absl::Status written = connection_->Execute("INSERT INTO t VALUES (2)");
  EXPECT_EQ(SqlStateOf(written), "25006");
  EXPECT_EQ(written.code(), absl::StatusCode::kUnavailable);
}

TEST_F(TransactionTest, SnapshotIsLeftByWhateverComesNext) {
  const auto leave = [this] {
    const auto snapshot = Transaction::Begin(connection_.get(), Transaction::Kind::kSnapshot);
    ASSERT_TRUE(snapshot.ok()) << snapshot.status();
    EXPECT_TRUE(connection_->is_in_transaction());
  };
  leave();
  EXPECT_FALSE(connection_->is_in_transaction());
  Insert(1);
  leave();
  EXPECT_EQ(connection_->Execute("INSERT INTO t VALUES (2)"), absl::OkStatus());
  leave();
  Pipeline pipeline(connection_.get());
  pipeline.Add("INSERT INTO t VALUES ($1)", 3);
  EXPECT_EQ(pipeline.Finish(), absl::OkStatus());
  leave();
  auto copy = CopyIn::Begin(connection_.get(), "COPY t FROM STDIN (FORMAT binary)");
  ASSERT_TRUE(copy.ok()) << copy.status();
  EXPECT_EQ((*copy)->AddRow(4), absl::OkStatus());
  EXPECT_EQ((*copy)->Finish(), absl::OkStatus());
  leave();
  EXPECT_EQ(connection_->AwaitNotification(absl::ZeroDuration()).status(), absl::OkStatus());
  leave();
  leave();
  EXPECT_EQ(Count(), 4);
}

TEST_F(TransactionTest, SnapshotIsLeftWithoutAFurtherStatement) {
  const auto other = Connect();
  {
    const auto snapshot = Transaction::Begin(connection_.get(), Transaction::Kind::kSnapshot);
    EXPECT_EQ(CountBy(*connection_), 0);
  }
  EXPECT_TRUE(hypermap::testing::Eventually([&] {
    return **other->QueryInt64(
               "SELECT count(*) FROM pg_stat_activity WHERE backend_xmin IS NOT "
               "NULL AND pid <> pg_backend_pid() AND datname = "
               "current_database()") == 0;
  }));
}

TEST_F(TransactionTest, SessionThatIsLostWhileItLeavesASnapshot) {
  const int64_t pid = **connection_->QueryInt64("SELECT pg_backend_pid()");
  {
    const auto snapshot = Transaction::Begin(connection_.get(), Transaction::Kind::kSnapshot);
    ASSERT_TRUE(Connect()->QueryInt64("SELECT pg_terminate_backend($1::int)::int", pid).ok());
  }
  EXPECT_EQ(connection_->Execute("SELECT 1").code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(connection_->is_broken());
}

TEST_F(TransactionTest, CommitAfterAnErrorIsAnError) {
  {
    auto transaction = Transaction::Begin(connection_.get());
    Insert(1);
    EXPECT_FALSE(connection_->Execute("SELECT 1 / 0").ok());
    EXPECT_TRUE(connection_->is_in_transaction());
    EXPECT_EQ(transaction->Commit().code(), absl::StatusCode::kInternal);
  }
  EXPECT_EQ(Count(), 0);
  EXPECT_FALSE(connection_->is_in_transaction());
}

TEST_F(TransactionTest, CommitMayFail) {
  ASSERT_EQ(
      connection_->Execute("CREATE TABLE u (a bigint REFERENCES t DEFERRABLE INITIALLY DEFERRED)"),
      absl::OkStatus());
  auto transaction = Transaction::Begin(connection_.get());
  ASSERT_EQ(connection_->Execute("INSERT INTO u VALUES (1)"), absl::OkStatus());
  EXPECT_EQ(SqlStateOf(transaction->Commit()), "23503");
  EXPECT_FALSE(connection_->is_in_transaction());
}

TEST_F(TransactionTest, CancelledCallerRollsBack) {
  {
    auto transaction = Transaction::Begin(connection_.get());
    Insert(1);
    CancelledAfter cancelled(0);
    EXPECT_EQ(transaction->Commit(), absl::CancelledError("the test cancels"));
    EXPECT_FALSE(connection_->is_broken());
    // The rollback is not given up.
    const Transaction at_the_end = *std::move(transaction);
  }
  EXPECT_EQ(Count(), 0);
  EXPECT_FALSE(connection_->is_in_transaction());
}

TEST_F(TransactionTest, ConflictsAreUnavailable) {
  ASSERT_EQ(connection_->Execute("INSERT INTO t VALUES (1)"), absl::OkStatus());
  ASSERT_EQ(connection_->Execute("BEGIN ISOLATION LEVEL REPEATABLE READ"), absl::OkStatus());
  EXPECT_EQ(CountBy(*connection_), 1);
  ASSERT_EQ(Connect()->Execute("UPDATE t SET a = 2"), absl::OkStatus());
  const absl::Status status = connection_->Execute("UPDATE t SET a = 3");
  EXPECT_EQ(SqlStateOf(status), "40001");
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
}

// With a standby that never confirms, a COMMIT waits. If it were cancelled, PostgreSQL would report
// it as done, though it would be lost with the primary.
class StandbyTest : public TransactionTest {
 protected:
  void SetUp() override {
    TransactionTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    options_.response_timeout = absl::Milliseconds(300);
    connection_ = Connect();
    AwaitStandby("nobody");
  }
  void TearDown() override {
    if (IsSkipped()) return;
    AwaitStandby("");
    TransactionTest::TearDown();
  }
  // Sets the standby that commits wait for.
  void AwaitStandby(const std::string& name) {
    const auto admin = Connect();
    ASSERT_EQ(admin->Execute("ALTER SYSTEM SET synchronous_standby_names = '" + name + "'"),
              absl::OkStatus());
    ASSERT_EQ(admin->Execute("SELECT pg_reload_conf()"), absl::OkStatus());
    ASSERT_TRUE(testing::Eventually([&] {
      auto rows = admin->Query("SHOW synchronous_standby_names");
      return rows.ok() && rows->Next() && rows->Text(0) == name;
    }));
    if (name.empty()) return;
    // The checkpointer tells the backends that there are standbys, when it has read the setting,
    // too.
    ASSERT_TRUE(testing::Eventually([&] {
      return !Connect()->Execute("SELECT pg_logical_emit_message(true, 'probe', '')").ok();
    }));
  }
  // The commit was not reported as done, and takes place once the standbys are not waited for.
  void ExpectUnknown(const absl::Status& status) {
    EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
    EXPECT_TRUE(connection_->is_broken());
    EXPECT_EQ(Count(), 0);
    AwaitStandby("");
    EXPECT_TRUE(testing::Eventually([&] { return Count() == 1; }));
  }
};

TEST_F(StandbyTest, CommitIsNotCancelled) {
  auto transaction = Transaction::Begin(connection_.get());
  Insert(1);
  absl::Status status;
  {
    CancelledAfter cancelled(1);
    status = transaction->Commit();
  }
  ExpectUnknown(status);
}

TEST_F(StandbyTest, PipelineWithCommitIsNotCancelled) {
  absl::Status status;
  {
    CancelledAfter cancelled(4);
    Pipeline pipeline(connection_.get());
    pipeline.Add("BEGIN");
    pipeline.Add("INSERT INTO t VALUES (1)");
    pipeline.Add("COMMIT");
    status = pipeline.Finish();
  }
  ExpectUnknown(status);
}

TEST_F(StandbyTest, PipelineThatCommitsByItselfIsNotCancelled) {
  absl::Status status;
  {
    CancelledAfter cancelled(2);
    Pipeline pipeline(connection_.get());
    pipeline.Add("INSERT INTO t VALUES (1)");
    status = pipeline.Finish();
  }
  ExpectUnknown(status);
}

TEST_F(StandbyTest, StatementThatCommitsByItselfIsNotCancelled) {
  absl::Status status;
  {
    CancelledAfter cancelled(1);
    status = connection_->Execute("INSERT INTO t VALUES (1)");
  }
  ExpectUnknown(status);
}

}  // namespace
}  // namespace hypermap::storage::postgres
