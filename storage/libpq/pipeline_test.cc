#include "storage/libpq/pipeline.h"

#include <deque>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/libpq/connection.h"
#include "storage/libpq/testing/database_test.h"

namespace hypermap::storage::postgres {
namespace {

using ::testing::HasSubstr;

class PipelineTest : public DatabaseTest {
 protected:
  void SetUp() override {
    DatabaseTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    ASSERT_EQ(connection_->Execute("CREATE TABLE t (a bigint PRIMARY KEY, b text)"),
              absl::OkStatus());
  }
  // As another connection sees them.
  int64_t Count() const { return **Connect()->QueryInt64("SELECT count(*) FROM t"); }
  // The connection has no transaction and can be used.
  void ExpectUsable() {
    EXPECT_FALSE(connection_->is_broken());
    EXPECT_FALSE(connection_->is_in_transaction());
    EXPECT_EQ(**connection_->QueryInt64("SELECT 7::bigint"), 7);
  }

  const std::string insert_ = "INSERT INTO t VALUES ($1, $2)";
};

TEST_F(PipelineTest, CommitsAll) {
  for (int round = 0; round < 3; ++round) {
    Pipeline pipeline(connection_.get());
    pipeline.Add("BEGIN");
    for (int i = 0; i < 100; ++i) pipeline.Add(insert_, 100 * round + i, "text");
    pipeline.Add("UPDATE t SET b = $1 WHERE a = $2", "changed", 100 * round);
    pipeline.Add("COMMIT");
    ASSERT_EQ(pipeline.Finish(), absl::OkStatus());
  }
  EXPECT_EQ(Count(), 300);
  EXPECT_EQ(**connection_->QueryInt64("SELECT count(*) FROM t WHERE b = 'changed'"), 3);
  ExpectUsable();
}

TEST_F(PipelineTest, WithoutBeginIsOneTransaction) {
  {
    Pipeline pipeline(connection_.get());
    pipeline.Add(insert_, 1, "text");
    pipeline.Add(insert_, 1, "again");
    EXPECT_EQ(pipeline.Finish().code(), absl::StatusCode::kAlreadyExists);
  }
  EXPECT_EQ(Count(), 0);
  Pipeline pipeline(connection_.get());
  pipeline.Add(insert_, 1, "text");
  pipeline.Add(insert_, 2, "text");
  EXPECT_EQ(pipeline.Finish(), absl::OkStatus());
  EXPECT_EQ(Count(), 2);
}

TEST_F(PipelineTest, IsPartOfATransaction) {
  auto transaction = Transaction::Begin(connection_.get());
  ASSERT_TRUE(transaction.ok());
  Pipeline pipeline(connection_.get());
  pipeline.Add(insert_, 1, "text");
  EXPECT_EQ(pipeline.Finish(), absl::OkStatus());
  EXPECT_TRUE(connection_->is_in_transaction());
  EXPECT_EQ(Count(), 0);
  EXPECT_EQ(transaction->Commit(), absl::OkStatus());
  EXPECT_EQ(Count(), 1);
}

TEST_F(PipelineTest, KeepsTheRowsThatWereAskedFor) {
  for (int round = 0; round < 2; ++round) {
    Pipeline pipeline(connection_.get());
    pipeline.Add(Transaction::BeginStatement(Transaction::Kind::kReadWrite));
    pipeline.Add("SELECT 1::bigint");
    for (int i = 0; i < 2; ++i) pipeline.Add(insert_, 2 * round + i, "text");
    pipeline.Ask("SELECT a FROM t ORDER BY a");
    pipeline.Ask("SELECT a FROM t WHERE a = $1", -1);
    pipeline.Ask("SELECT count(*) FROM t");
    ASSERT_EQ(pipeline.Finish(), absl::OkStatus());
    Transaction transaction = Transaction::Begun(connection_.get(), Transaction::Kind::kReadWrite);
    std::deque<Rows> rows = pipeline.TakeRows();
    ASSERT_EQ(rows.size(), 3u);
    EXPECT_EQ(rows[0].size(), 2 * round + 2);
    ASSERT_TRUE(rows[0].Next());
    EXPECT_EQ(rows[0].Int64(0), 0);
    EXPECT_EQ(rows[1].size(), 0);
    ASSERT_TRUE(rows[2].Next());
    EXPECT_EQ(rows[2].Int64(0), 2 * round + 2);
    EXPECT_EQ(transaction.Commit(), absl::OkStatus());
  }
  EXPECT_EQ(Count(), 4);
  ExpectUsable();
}

TEST_F(PipelineTest, RowsAreReadWhileTheDatabaseWorks) {
  const auto other = Connect();
  ASSERT_EQ(other->Execute("SELECT pg_advisory_lock(7)"), absl::OkStatus());
  Pipeline pipeline(connection_.get());
  pipeline.Add(Transaction::BeginStatement(Transaction::Kind::kSnapshot));
  pipeline.Ask("SELECT 1::bigint");
  pipeline.Flush();
  pipeline.Ask("SELECT 2::bigint FROM pg_advisory_xact_lock(7)");
  pipeline.Flush();
  pipeline.Ask("SELECT 3::bigint");
  // The second statement waits, and the first was answered all the same.
  absl::StatusOr<Rows> rows = pipeline.NextRows();
  ASSERT_TRUE(rows.ok() && rows->Next()) << rows.status();
  EXPECT_EQ(rows->Int64(0), 1);
  ASSERT_EQ(other->Execute("SELECT pg_advisory_unlock(7)"), absl::OkStatus());
  rows = pipeline.NextRows();
  ASSERT_TRUE(rows.ok() && rows->Next()) << rows.status();
  EXPECT_EQ(rows->Int64(0), 2);
  ASSERT_EQ(pipeline.Finish(), absl::OkStatus());
  std::deque<Rows> rest = pipeline.TakeRows();
  ASSERT_EQ(rest.size(), 1u);
  ASSERT_TRUE(rest.front().Next());
  EXPECT_EQ(rest.front().Int64(0), 3);
  { const auto t = Transaction::Begun(connection_.get(), Transaction::Kind::kSnapshot); }
  ExpectUsable();
}

TEST_F(PipelineTest, ErrorEndsTheReadingOfRows) {
  Pipeline pipeline(connection_.get());
  pipeline.Ask("SELECT 1::bigint");
  pipeline.Ask("SELECT 1 / 0");
  pipeline.Ask("SELECT 3::bigint");
  EXPECT_TRUE(pipeline.NextRows().ok());
  EXPECT_EQ(SqlStateOf(pipeline.NextRows().status()), "22012");
  ExpectUsable();
}

TEST_F(PipelineTest, MoreRowsThanWereAskedFor) {
  Pipeline pipeline(connection_.get());
  pipeline.Ask("SELECT 1::bigint");
  EXPECT_TRUE(pipeline.NextRows().ok());
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(pipeline.NextRows().status().code(), absl::StatusCode::kInternal);
  }
  ExpectUsable();
}

TEST_F(PipelineTest, IsGivenUpWhileRowsAreRead) {
  {
    Pipeline pipeline(connection_.get());
    pipeline.Add(Transaction::BeginStatement(Transaction::Kind::kReadWrite));
    pipeline.Ask("SELECT 1::bigint");
    pipeline.Add(insert_, 1, "text");
    EXPECT_TRUE(pipeline.NextRows().ok());
  }
  EXPECT_EQ(Count(), 0);
  ExpectUsable();
}

TEST_F(PipelineTest, WhatItBeganIsRolledBackUnlessCommitted) {
  Pipeline pipeline(connection_.get());
  pipeline.Add(Transaction::BeginStatement(Transaction::Kind::kReadWrite));
  pipeline.Add(insert_, 1, "text");
  ASSERT_EQ(pipeline.Finish(), absl::OkStatus());
  {
    const Transaction transaction =
        Transaction::Begun(connection_.get(), Transaction::Kind::kReadWrite);
    EXPECT_TRUE(connection_->is_in_transaction());
  }
  EXPECT_EQ(Count(), 0);
  ExpectUsable();
}

TEST_F(PipelineTest, NothingToDoIsDone) {
  Pipeline pipeline(connection_.get());
  EXPECT_EQ(pipeline.Finish(), absl::OkStatus());
  ExpectUsable();
}

TEST_F(PipelineTest, FirstErrorIsReportedAndAllIsRolledBack) {
  Pipeline pipeline(connection_.get());
  pipeline.Add("BEGIN");
  pipeline.Add(insert_, 1, "text");
  pipeline.Add(insert_, 1, "text");
  pipeline.Add("SELECT no_such_column FROM t");
  pipeline.Add("COMMIT");
  const absl::Status status = pipeline.Finish();
  EXPECT_EQ(status.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(SqlStateOf(status), "23505");
  EXPECT_EQ(Count(), 0);
  ExpectUsable();
}

TEST_F(PipelineTest, ErrorRollsTheTransactionBackThatWasBegunBefore) {
  auto transaction = Transaction::Begin(connection_.get());
  ASSERT_TRUE(connection_->Query(insert_, 1, "text").ok());
  {
    Pipeline pipeline(connection_.get());
    pipeline.Add("SELECT 1 / 0");
    EXPECT_EQ(SqlStateOf(pipeline.Finish()), "22012");
  }
  // Its COMMIT must not be taken for a success.
  EXPECT_EQ(transaction->Commit().code(), absl::StatusCode::kInternal);
  EXPECT_EQ(Count(), 0);
  ExpectUsable();
}

TEST_F(PipelineTest, CommitOfAFailedTransactionIsAnError) {
  ASSERT_EQ(connection_->Execute("BEGIN"), absl::OkStatus());
  EXPECT_FALSE(connection_->Execute("SELECT 1 / 0").ok());
  Pipeline pipeline(connection_.get());
  pipeline.Add("COMMIT");
  EXPECT_EQ(pipeline.Finish().code(), absl::StatusCode::kInternal);
  ExpectUsable();
}

TEST_F(PipelineTest, StatementsOfAFailedPipelineAreNotBelievedToBePrepared) {
  {
    Pipeline pipeline(connection_.get());
    pipeline.Add("SELECT 1 / $1", 0);
    pipeline.Add(insert_, 1, "text");
    EXPECT_FALSE(pipeline.Finish().ok());
  }
  {
    Pipeline pipeline(connection_.get());
    pipeline.Add("no SQL");
    EXPECT_EQ(SqlStateOf(pipeline.Finish()), "42601");
  }
  EXPECT_EQ(SqlStateOf(connection_->Query("no SQL").status()), "42601");
  EXPECT_TRUE(connection_->Query(insert_, 1, "text").ok());
  EXPECT_TRUE(connection_->Query("SELECT 1 / $1", 1).ok());
}

TEST_F(PipelineTest, InvalidTextFailsTheWholePipeline) {
  for (const bool has_begin : {true, false}) {
    Pipeline pipeline(connection_.get());
    if (has_begin) pipeline.Add("BEGIN");
    pipeline.Add(insert_, 1, "text");
    pipeline.Add(insert_, 2, "\xff");
    pipeline.Add(insert_, 3, "text");
    if (has_begin) pipeline.Add("COMMIT");
    EXPECT_EQ(pipeline.Finish(), absl::InvalidArgumentError("the text $2 is not UTF-8"));
    EXPECT_EQ(Count(), 0);
    ExpectUsable();
  }
}

TEST_F(PipelineTest, InvalidTextDoesNotHideAnEarlierError) {
  Pipeline pipeline(connection_.get());
  pipeline.Add(insert_, 1, "text");
  pipeline.Add(insert_, 1, "text");
  pipeline.Add(insert_, 2, "\xff");
  EXPECT_EQ(pipeline.Finish().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(PipelineTest, IsRolledBackIfNotFinished) {
  for (const bool has_begin : {true, false}) {
    {
      Pipeline pipeline(connection_.get());
      if (has_begin) pipeline.Add("BEGIN");
      pipeline.Add(insert_, 1, "text");
    }
    EXPECT_EQ(Count(), 0);
    ExpectUsable();
  }
}

// Statements and answers of 100 MB each: more than sockets hold.
TEST_F(PipelineTest, SendsAndReceivesALotWithoutADeadlock) {
  const std::string text(1000, 'x');
  Pipeline pipeline(connection_.get());
  pipeline.Add("BEGIN");
  for (int i = 0; i < 100000; ++i) {
    pipeline.Add("INSERT INTO t VALUES ($1, $2) RETURNING b", i, text);
  }
  pipeline.Add("COMMIT");
  EXPECT_EQ(pipeline.Finish(), absl::OkStatus());
  EXPECT_EQ(Count(), 100000);
}

TEST_F(PipelineTest, OneStatementMayBeLarge) {
  const std::string text(8000000, 'x');
  Pipeline pipeline(connection_.get());
  for (int i = 0; i < 3; ++i) pipeline.Add("INSERT INTO t VALUES ($1, $2) RETURNING b", i, text);
  EXPECT_EQ(pipeline.Finish(), absl::OkStatus());
  EXPECT_EQ(**connection_->QueryInt64("SELECT sum(length(b)) FROM t"), 24000000);
}

TEST_F(PipelineTest, IsCancelledWhereverItLooks) {
  const std::string text(1000, 'x');
  const int times = TimesCancelled([&] {
    Pipeline pipeline(connection_.get());
    pipeline.Add("BEGIN");
    for (int i = 0; i < 200; ++i) pipeline.Add(insert_, i, text);
    pipeline.Add("COMMIT");
    return pipeline.Finish();
  });
  // At each statement.
  EXPECT_GT(times, 10);
  EXPECT_EQ(Count(), 200);
  ExpectUsable();
}

TEST_F(PipelineTest, IsCancelledWhileTheDatabaseWorks) {
  for (const bool has_begin : {true, false}) {
    CancelledAfter cancelled(10);
    Pipeline pipeline(connection_.get());
    if (has_begin) pipeline.Add("BEGIN");
    pipeline.Add(insert_, 1, "text");
    pipeline.Add("SELECT pg_sleep(60)");
    // What is kept is sent, and waited for.
    for (int i = 0; i < 100; ++i) pipeline.Add("SELECT $1", std::string(100000, 'x'));
    EXPECT_EQ(pipeline.Finish(), absl::CancelledError("the test cancels"));
    const ScopedCancellation none(nullptr);
    EXPECT_EQ(Count(), 0);
    ExpectUsable();
  }
}

TEST_F(PipelineTest, StatementsInATransactionAreCancelled) {
  auto transaction = Transaction::Begin(connection_.get());
  {
    CancelledAfter cancelled(10);
    Pipeline pipeline(connection_.get());
    pipeline.Add("SELECT pg_sleep(60)");
    EXPECT_EQ(pipeline.Finish(), absl::CancelledError("the test cancels"));
  }
  EXPECT_FALSE(transaction->Commit().ok());
  ExpectUsable();
}

TEST_F(PipelineTest, CommitThatWasAddedIsWaitedFor) {
  CancelledAfter cancelled(4);
  Pipeline pipeline(connection_.get());
  pipeline.Add("BEGIN");
  pipeline.Add(insert_, 1, "text");
  pipeline.Add("SELECT pg_sleep(0.1)");
  pipeline.Add("COMMIT");
  EXPECT_EQ(cancelled.num_looks(), 4);
  EXPECT_EQ(pipeline.Finish(), absl::OkStatus());
  const ScopedCancellation none(nullptr);
  EXPECT_EQ(Count(), 1);
}

TEST_F(PipelineTest, OutcomeIsUnknownIfTheSessionEnds) {
  Pipeline pipeline(connection_.get());
  pipeline.Add("BEGIN");
  pipeline.Add(insert_, 1, "text");
  pipeline.Add("SELECT pg_terminate_backend(pg_backend_pid())");
  pipeline.Add("COMMIT");
  const absl::Status status = pipeline.Finish();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(SqlStateOf(status), "57P01");
  EXPECT_TRUE(connection_->is_broken());
  EXPECT_EQ(Count(), 0);
  Pipeline next(connection_.get());
  next.Add("SELECT 1");
  EXPECT_EQ(next.Finish().code(), absl::StatusCode::kUnavailable);
}

TEST_F(PipelineTest, DatabaseThatStopsAnsweringBreaksTheConnection) {
  options_.response_timeout = absl::Milliseconds(200);
  connection_ = Connect();
  Pipeline pipeline(connection_.get());
  pipeline.Add("BEGIN");
  pipeline.Add(insert_, 1, "text");
  pipeline.Add("SELECT pg_sleep(60)");
  pipeline.Add("COMMIT");
  const absl::Status status = pipeline.Finish();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr("did not answer within 200ms"));
  EXPECT_TRUE(connection_->is_broken());
  EXPECT_EQ(Count(), 0);
}

}  // namespace
}  // namespace hypermap::storage::postgres
