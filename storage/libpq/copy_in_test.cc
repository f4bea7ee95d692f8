#include "storage/libpq/copy_in.h"

#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "gtest/gtest.h"
#include "storage/libpq/connection.h"
#include "storage/libpq/testing/database_test.h"

namespace hypermap::storage::postgres {
namespace {

class CopyInTest : public DatabaseTest {
 protected:
  void SetUp() override {
    DatabaseTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    ASSERT_EQ(connection_->Execute(
                  "CREATE TABLE t (a bigint PRIMARY KEY, b text, c bytea, d double precision)"),
              absl::OkStatus());
  }
  std::unique_ptr<CopyIn> Begin() {
    auto copy = CopyIn::Begin(connection_.get(), "COPY t FROM STDIN (FORMAT binary)");
    EXPECT_TRUE(copy.ok()) << copy.status();
    return copy.ok() ? *std::move(copy) : nullptr;
  }
  int64_t Count() { return **connection_->QueryInt64("SELECT count(*) FROM t"); }
};

TEST_F(CopyInTest, LoadsManyRows) {
  const std::string blob(100, '\xff');
  const auto copy = Begin();
  for (int i = 0; i < 100000; ++i) {
    ASSERT_EQ(copy->AddRow(i, absl::StrCat("ä", i), BlobView{blob}, 0.5 * i), absl::OkStatus());
  }
  ASSERT_EQ(copy->Finish(), absl::OkStatus());
  EXPECT_EQ(Count(), 100000);
  auto row = connection_->Query("SELECT b, c, d FROM t WHERE a = 99999");
  ASSERT_TRUE(row->Next());
  EXPECT_EQ(row->Text(0), "ä99999");
  EXPECT_EQ(row->Blob(1), blob);
  EXPECT_EQ(row->Double(2), 49999.5);
}

TEST_F(CopyInTest, LoadsNullsAndNothing) {
  const auto nothing = Begin();
  ASSERT_EQ(nothing->Finish(), absl::OkStatus());
  EXPECT_EQ(Count(), 0);
  const auto copy = Begin();
  ASSERT_EQ(copy->AddRow(1, std::optional<std::string>(), std::optional<BlobView>(),
                         std::optional<double>()),
            absl::OkStatus());
  ASSERT_EQ(copy->Finish(), absl::OkStatus());
  EXPECT_EQ(**connection_->QueryInt64("SELECT count(*) FROM t WHERE b IS NULL AND d IS NULL"), 1);
}

TEST_F(CopyInTest, IsGivenUpIfNotFinished) {
  for (const int rows : {0, 3, 10000}) {
    {
      const auto copy = Begin();
      for (int i = 0; i < rows; ++i) {
        ASSERT_EQ(copy->AddRow(i, std::string(100, 'x'), BlobView{}, 0.0), absl::OkStatus());
      }
    }
    EXPECT_EQ(Count(), 0);
    EXPECT_FALSE(connection_->is_broken());
  }
}

TEST_F(CopyInTest, ErrorsAreReportedAtTheEnd) {
  {
    const auto copy = Begin();
    for (int i = 0; i < 100000; ++i) {
      ASSERT_EQ(copy->AddRow(i % 1000, "text", BlobView{}, 0.0), absl::OkStatus());
    }
    EXPECT_EQ(copy->Finish().code(), absl::StatusCode::kAlreadyExists);
  }
  {
    const auto copy = Begin();
    ASSERT_EQ(copy->AddRow("not a number", "text", BlobView{}, 0.0), absl::OkStatus());
    EXPECT_EQ(SqlStateOf(copy->Finish()), "22P03");  // invalid binary representation
  }
  EXPECT_EQ(Count(), 0);
}

TEST_F(CopyInTest, InvalidTextIsFinal) {
  const auto copy = Begin();
  ASSERT_EQ(copy->AddRow(1, "text", BlobView{}, 0.0), absl::OkStatus());
  const absl::Status refused = absl::InvalidArgumentError("the text $2 is not UTF-8");
  EXPECT_EQ(copy->AddRow(2, "\xff", BlobView{}, 0.0), refused);
  EXPECT_EQ(copy->AddRow(3, "text", BlobView{}, 0.0), refused);
  EXPECT_EQ(copy->Finish(), refused);
  EXPECT_EQ(Count(), 0);
}

TEST_F(CopyInTest, WrongStatementsAreErrors) {
  for (const std::string sql :
       {"SELECT 1", "no SQL", "COPY none FROM STDIN", "COPY t TO STDOUT", "SELECT 1; SELECT 2"}) {
    EXPECT_EQ(CopyIn::Begin(connection_.get(), sql).status().code(), absl::StatusCode::kInternal)
        << sql;
    if (connection_->is_broken()) connection_ = Connect();
    EXPECT_EQ(Count(), 0);
  }
}

TEST_F(CopyInTest, IsCancelledWhereverItLooks) {
  const int times = TimesCancelled([&] {
    absl::StatusOr<std::unique_ptr<CopyIn>> copy =
        CopyIn::Begin(connection_.get(), "COPY t FROM STDIN (FORMAT binary)");
    absl::Status status = copy.status();
    for (int i = 0; status.ok() && i < 5000; ++i) {
      status = (*copy)->AddRow(i, std::string(1000, 'x'), BlobView{}, 0.0);
    }
    return status.ok() ? (*copy)->Finish() : status;
  });
  EXPECT_GT(times, 5);
  EXPECT_EQ(Count(), 5000);
}

TEST_F(CopyInTest, IsPartOfATransaction) {
  {
    const auto transaction = Transaction::Begin(connection_.get());
    const auto copy = Begin();
    ASSERT_EQ(copy->AddRow(1, "text", BlobView{}, 0.0), absl::OkStatus());
    ASSERT_EQ(copy->Finish(), absl::OkStatus());
    EXPECT_EQ(Count(), 1);
  }
  EXPECT_EQ(Count(), 0);
}

TEST_F(CopyInTest, LostSessionIsAnError) {
  const auto copy = Begin();
  const auto other = Connect();
  ASSERT_TRUE(other
                  ->Query("SELECT pg_terminate_backend(pid) FROM pg_stat_activity "
                          "WHERE pid <> pg_backend_pid() AND datname = current_database()")
                  .ok());
  absl::Status status;
  for (int i = 0; i < 100000 && status.ok(); ++i) {
    status = copy->AddRow(i, std::string(1000, 'x'), BlobView{}, 0.0);
  }
  if (status.ok()) status = copy->Finish();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
  EXPECT_TRUE(connection_->is_broken());
  EXPECT_EQ(copy->Finish().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(CopyIn::Begin(connection_.get(), "COPY t FROM STDIN").status().code(),
            absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace hypermap::storage::postgres
