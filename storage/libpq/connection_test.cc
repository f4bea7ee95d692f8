#include "storage/libpq/connection.h"

#include <signal.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "gtest/gtest.h"
#include "storage/libpq/testing/database_test.h"
#include "tests/support/eventually.h"

namespace hypermap::storage::postgres {
namespace {

using testing::Eventually;

class ConnectionTest : public DatabaseTest {
 protected:
  void ExpectUsable() {
    EXPECT_FALSE(connection_->is_broken());
    EXPECT_EQ(**connection_->QueryInt64("SELECT 7::bigint"), 7);
  }
  int64_t PidOf(Connection& connection) {
    return **connection.QueryInt64("SELECT pg_backend_pid()");
  }
  // How many statements of this text run in other sessions.
  int64_t CountRunning(const std::string& sql) {
    return **Connect()->QueryInt64(
        "SELECT count(*) FROM pg_stat_activity WHERE state = 'active' AND query = $1", sql);
  }
};

TEST_F(ConnectionTest, RunsStatements) {
  ASSERT_EQ(connection_->Execute("CREATE TABLE t (a bigint, b text); CREATE INDEX ON t (a)"),
            absl::OkStatus());
  for (int i = 0; i < 3; ++i) {
    const auto rows = connection_->Query("INSERT INTO t VALUES ($1, $2)", i, "text");
    ASSERT_TRUE(rows.ok()) << rows.status();
    EXPECT_EQ(rows->changed_rows(), 1);
  }
  EXPECT_EQ(connection_->Query("UPDATE t SET b = 'x' WHERE a > $1", 0)->changed_rows(), 2);
  auto rows = connection_->Query("SELECT a, b FROM t ORDER BY a");
  ASSERT_TRUE(rows.ok()) << rows.status();
  EXPECT_EQ(rows->size(), 3);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(rows->Next());
    EXPECT_EQ(rows->Int64(0), i);
    EXPECT_EQ(rows->Text(1), i == 0 ? "text" : "x");
  }
  EXPECT_FALSE(rows->Next());
  EXPECT_EQ(connection_->Execute(""), absl::OkStatus());
}

TEST_F(ConnectionTest, QueryInt64TakesTheFirstRow) {
  EXPECT_EQ(**connection_->QueryInt64("SELECT generate_series($1, $1 + 2)", 5), 5);
  EXPECT_EQ(*connection_->QueryInt64("SELECT 1::bigint WHERE false"), std::nullopt);
  EXPECT_EQ(*connection_->QueryInt64("SELECT NULL::bigint"), std::nullopt);
  EXPECT_EQ(connection_->QueryInt64("SELECT 'text'").status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(ConnectionTest, ErrorsAreOneLineWithTheDetail) {
  ASSERT_EQ(connection_->Execute("CREATE TABLE t (a bigint PRIMARY KEY); INSERT INTO t VALUES (1)"),
            absl::OkStatus());
  const absl::Status twice = connection_->Query("INSERT INTO t VALUES ($1)", 1).status();
  EXPECT_EQ(twice.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(
      twice.message(),
      "duplicate key value violates unique constraint \"t_pkey\": Key (a)=(1) already exists. "
      "(SQLSTATE 23505)");
  const absl::Status raised = connection_->Execute(
      "DO $$ BEGIN RAISE EXCEPTION E'two\\nlines' USING ERRCODE = '53100', DETAIL = E'a\\nb'; END "
      "$$");
  EXPECT_EQ(raised.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(raised.message(), "two lines: a b (SQLSTATE 53100)");
  ExpectUsable();
}

TEST_F(ConnectionTest, ScriptEndsAtItsFirstError) {
  EXPECT_EQ(SqlStateOf(connection_->Execute("CREATE TABLE t (a bigint); SELECT 1 / 0; no SQL")),
            "42601");
  EXPECT_EQ(SqlStateOf(connection_->Execute("CREATE TABLE t (a bigint); SELECT 1 / 0; SELECT 2")),
            "22012");
  EXPECT_EQ(**connection_->QueryInt64("SELECT count(*) FROM pg_class WHERE relname = 't'"), 0);
}

TEST_F(ConnectionTest, StatementThatIsNoStatementIsAnError) {
  EXPECT_EQ(connection_->Execute("COPY (SELECT 1) TO STDOUT").code(), absl::StatusCode::kInternal);
  EXPECT_TRUE(connection_->is_broken());
  EXPECT_EQ(connection_->Execute("SELECT 1").code(), absl::StatusCode::kUnavailable);
  connection_ = Connect();
  EXPECT_FALSE(connection_->Query("SELECT 1; SELECT 2").ok());
  ExpectUsable();
}

TEST_F(ConnectionTest, StatementsArePreparedOnce) {
  const std::string count = "SELECT count(*) FROM pg_prepared_statements";
  EXPECT_EQ(**connection_->QueryInt64(count), 1);  // itself
  for (int i = 0; i < 10; ++i) EXPECT_EQ(**connection_->QueryInt64("SELECT $1", i), i);
  EXPECT_EQ(**connection_->QueryInt64(count), 2);
  // The same text with another type.
  EXPECT_EQ(connection_->Query("SELECT $1", "text")->size(), 1);
  EXPECT_EQ(**connection_->QueryInt64(count), 2);
  // A statement that can't be prepared.
  EXPECT_EQ(SqlStateOf(connection_->Query("no SQL").status()), "42601");
  EXPECT_EQ(SqlStateOf(connection_->Query("no SQL").status()), "42601");
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(**connection_->QueryInt64(absl::StrCat("SELECT ", i, "::bigint")), i);
  }
  EXPECT_EQ(**connection_->QueryInt64(count), 256);
}

TEST_F(ConnectionTest, NothingIsPreparedInSharedSessions) {
  options_.prepares = false;
  connection_ = Connect();
  for (int i = 0; i < 10; ++i) EXPECT_EQ(**connection_->QueryInt64("SELECT $1", i), i);
  EXPECT_EQ(**connection_->QueryInt64("SELECT count(*) FROM pg_prepared_statements"), 0);
}

TEST_F(ConnectionTest, OwnSessionsEndIfTheirClientIsGone) {
  const std::string setting = "SELECT current_setting($1)";
  const auto show = [&](const char* name) {
    auto rows = connection_->Query(setting, name);
    return rows.ok() && rows->Next() ? std::string(rows->Text(0)) : "";
  };
  EXPECT_EQ(show("idle_in_transaction_session_timeout"), "10s");
  EXPECT_EQ(show("client_connection_check_interval"), "2s");
  EXPECT_EQ(show("tcp_keepalives_idle"), "5");
  EXPECT_EQ(show("jit"), "off");
  EXPECT_EQ(show("enable_seqscan"), "off");
  EXPECT_EQ(show("client_encoding"), "UTF8");
  EXPECT_EQ(show("application_name"), "hypermap");
  options_.target +=
      " options='-c work_mem=8MB -c jit=on' application_name=other client_encoding=LATIN1";
  connection_ = Connect();
  EXPECT_EQ(show("work_mem"), "8MB");
  EXPECT_EQ(show("jit"), "off");
  EXPECT_EQ(show("client_encoding"), "UTF8");
  EXPECT_EQ(show("application_name"), "other");
  options_.prepares = false;
  connection_ = Connect();
  EXPECT_EQ(show("jit"), "on");
  EXPECT_EQ(show("idle_in_transaction_session_timeout"), "0");
}

TEST_F(ConnectionTest, CancelledStatementEndsAtOnce) {
  for (const int looks : {1, 2, 20}) {
    const absl::Time begin = absl::Now();
    absl::Status status;
    {
      CancelledAfter cancelled(looks);
      status = connection_->Query("SELECT pg_sleep(60)").status();
    }
    EXPECT_EQ(status, absl::CancelledError("the test cancels"));
    EXPECT_LT(absl::Now() - begin, absl::Seconds(4));
    ExpectUsable();
    EXPECT_EQ(CountRunning("SELECT pg_sleep(60)"), 0);
  }
}

TEST_F(ConnectionTest, CancelledCallerSendsNothing) {
  {
    CancelledAfter cancelled(0);
    EXPECT_TRUE(absl::IsCancelled(connection_->Execute("CREATE TABLE t (a bigint)")));
    EXPECT_TRUE(absl::IsCancelled(connection_->Query("CREATE TABLE t (a bigint)").status()));
    EXPECT_TRUE(absl::IsCancelled(Connection::Open(options_).status()));
  }
  EXPECT_EQ(**connection_->QueryInt64("SELECT count(*) FROM pg_class WHERE relname = 't'"), 0);
}

TEST_F(ConnectionTest, CancelledStatementOfATransactionFailsIt) {
  ASSERT_EQ(connection_->Execute("CREATE TABLE t (a bigint)"), absl::OkStatus());
  {
    auto transaction = Transaction::Begin(connection_.get());
    ASSERT_EQ(connection_->Execute("INSERT INTO t VALUES (1)"), absl::OkStatus());
    CancelledAfter cancelled(3);
    EXPECT_TRUE(
        absl::IsCancelled(connection_->Execute("UPDATE t SET a = 2 + length(pg_sleep(60)::text)")));
  }
  EXPECT_EQ(**connection_->QueryInt64("SELECT count(*) FROM t"), 0);
  ExpectUsable();
}

TEST_F(ConnectionTest, WorkIsCancelledWhereverItLooks) {
  const int times = TimesCancelled([&] {
    return connection_->Query("SELECT sum(a) FROM generate_series(1, 200000) AS t (a)").status();
  });
  EXPECT_GT(times, 1);
  ExpectUsable();
}

TEST_F(ConnectionTest, LargeAnswerIsCancelled) {
  CancelledAfter cancelled(3);
  const std::string sql = "SELECT repeat('x', 1000) FROM generate_series(1, 10000000)";
  EXPECT_TRUE(absl::IsCancelled(connection_->Query(sql).status()));
  const ScopedCancellation none(nullptr);
  ExpectUsable();
}

TEST_F(ConnectionTest, StatementThatTakesTooLongBreaksTheConnection) {
  options_.response_timeout = absl::Milliseconds(200);
  const auto impatient = Connect();
  const absl::Status status = impatient->Query("SELECT pg_sleep(60)").status();
  EXPECT_EQ(status, absl::UnavailableError("the database did not answer within 200ms"));
  EXPECT_TRUE(impatient->is_broken());
  EXPECT_EQ(impatient->Execute("SELECT 1"), status);
  EXPECT_EQ(impatient->AwaitNotification(absl::Seconds(60)).status(), status);
  EXPECT_EQ(Transaction::Begin(impatient.get()).status(), status);
  // The statement was cancelled, too.
  EXPECT_TRUE(Eventually([&] { return CountRunning("SELECT pg_sleep(60)") == 0; }));
}

TEST_F(ConnectionTest, LongAnswersThatArriveAreWaitedFor) {
  options_.response_timeout = absl::Milliseconds(300);
  const auto impatient = Connect();
  // A row each 10 ms, and more than the server keeps: 1 s in all.
  auto rows =
      impatient->Query("SELECT repeat('x', 10000), pg_sleep(0.01) FROM generate_series(1, 100)");
  ASSERT_TRUE(rows.ok()) << rows.status();
  EXPECT_EQ(rows->size(), 100);
}

// A frozen server.
TEST_F(ConnectionTest, DatabaseThatDoesNotEvenCancelBreaksTheConnection) {
  options_.response_timeout = absl::Milliseconds(500);
  connection_ = Connect();
  const auto pid = static_cast<pid_t>(PidOf(*connection_));
  ASSERT_EQ(kill(pid, SIGSTOP), 0);
  absl::Status status;
  {
    CancelledAfter cancelled(3);
    status = connection_->Query("SELECT 1::bigint").status();
  }
  EXPECT_TRUE(absl::IsCancelled(status)) << status;
  EXPECT_TRUE(connection_->is_broken());
  EXPECT_EQ(connection_->Execute("SELECT 1").code(), absl::StatusCode::kUnavailable);
  kill(pid, SIGCONT);
}

TEST_F(ConnectionTest, SessionThatWasEndedIsUnavailable) {
  const absl::Status itself =
      connection_->Query("SELECT pg_terminate_backend(pg_backend_pid())").status();
  EXPECT_EQ(itself.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(SqlStateOf(itself), "57P01");
  EXPECT_TRUE(connection_->is_broken());
  EXPECT_FALSE(connection_->is_in_transaction());

  connection_ = Connect();
  ASSERT_TRUE(Connect()->Query("SELECT pg_terminate_backend($1::int)", PidOf(*connection_)).ok());
  const absl::Status idle = connection_->Query("SELECT 1").status();
  EXPECT_EQ(idle.code(), absl::StatusCode::kUnavailable) << idle;
  EXPECT_TRUE(connection_->is_broken());
}

TEST_F(ConnectionTest, IdleTransactionIsEnded) {
  ASSERT_EQ(connection_->Execute("SET idle_in_transaction_session_timeout = '50ms'"),
            absl::OkStatus());
  const int64_t pid = PidOf(*connection_);
  const auto other = Connect();
  auto transaction = Transaction::Begin(connection_.get());
  EXPECT_TRUE(Eventually([&] {
    return **other->QueryInt64("SELECT count(*) FROM pg_stat_activity WHERE pid = $1", pid) == 0;
  }));
  EXPECT_EQ(transaction->Commit().code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(connection_->is_broken());
}

TEST_F(ConnectionTest, LockThatIsNotToBeHadInTimeIsUnavailable) {
  ASSERT_EQ(connection_->Execute("CREATE TABLE t (a bigint)"), absl::OkStatus());
  const auto transaction = Transaction::Begin(connection_.get());
  ASSERT_EQ(connection_->Execute("LOCK TABLE t"), absl::OkStatus());
  const auto other = Connect();
  const absl::Status status = other->Execute("SET lock_timeout = '10ms'; INSERT INTO t VALUES (1)");
  EXPECT_EQ(SqlStateOf(status), "55P03");
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
}

TEST_F(ConnectionTest, NotificationsArrive) {
  const auto sender = Connect();
  ASSERT_EQ(connection_->Execute("LISTEN maps"), absl::OkStatus());
  EXPECT_EQ(*connection_->AwaitNotification(absl::ZeroDuration()), std::nullopt);
  ASSERT_TRUE(sender->Query("SELECT pg_notify('maps', $1)", "first").ok());
  ASSERT_TRUE(sender->Query("SELECT pg_notify('other', $1)", "none").ok());
  ASSERT_EQ(sender->Execute("NOTIFY maps"), absl::OkStatus());
  EXPECT_EQ(*connection_->AwaitNotification(absl::Seconds(60)), "first");
  EXPECT_EQ(*connection_->AwaitNotification(absl::Seconds(60)), "");
  EXPECT_EQ(*connection_->AwaitNotification(absl::Milliseconds(20)), std::nullopt);
  // Also those that came with the answer to a statement.
  ASSERT_EQ(connection_->Execute("NOTIFY maps, 'own'"), absl::OkStatus());
  EXPECT_EQ(*connection_->AwaitNotification(absl::ZeroDuration()), "own");
}

TEST_F(ConnectionTest, WaitForNotificationsEnds) {
  {
    CancelledAfter cancelled(3);
    EXPECT_TRUE(absl::IsCancelled(connection_->AwaitNotification(absl::Seconds(60)).status()));
  }
  ExpectUsable();
  ASSERT_TRUE(Connect()->Query("SELECT pg_terminate_backend($1::int)", PidOf(*connection_)).ok());
  EXPECT_EQ(connection_->AwaitNotification(absl::Seconds(60)).status().code(),
            absl::StatusCode::kUnavailable);
  EXPECT_TRUE(connection_->is_broken());
}

TEST_F(ConnectionTest, ConnectionsAreUsedByThreadsOfTheirOwn) {
  std::vector<std::thread> threads;
  threads.reserve(4);
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([this] {
      const auto connection = Connect();
      for (int i = 0; i < 50; ++i) EXPECT_EQ(**connection->QueryInt64("SELECT $1", i), i);
      CancelledAfter cancelled(3);
      EXPECT_TRUE(absl::IsCancelled(connection->Query("SELECT pg_sleep(60)").status()));
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace hypermap::storage::postgres
