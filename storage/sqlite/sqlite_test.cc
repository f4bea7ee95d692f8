#include "storage/sqlite/sqlite.h"

#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {
namespace {

using ::testing::HasSubstr;

std::unique_ptr<Database> Connect(const std::string& path) {
  auto database = Database::Open(path, Database::OpenMode::kCreate, absl::ZeroDuration());
  EXPECT_TRUE(database.ok()) << database.status();
  return database.ok() ? *std::move(database) : nullptr;
}

class SqliteTest : public ::testing::Test {
 protected:
  void SetUp() override {
    database_ = Connect(folder_ / "test.sqlite");
    ASSERT_TRUE(database_->Execute("CREATE TABLE t (a, b TEXT UNIQUE)").ok());
  }
  int64_t Count() { return **database_->QueryInt64("SELECT count(*) FROM t"); }

  testing::TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
};

TEST_F(SqliteTest, ValuesOfAllTypesComeBack) {
  const std::string bytes("\0x\0", 3);
  ASSERT_TRUE(database_->Run("INSERT INTO t VALUES (?, ?)", BlobView{bytes}, bytes).ok());
  ASSERT_TRUE(database_->Run("INSERT INTO t VALUES (?, ?)", 1.5, "").ok());
  ASSERT_TRUE(
      database_->Run("INSERT INTO t VALUES (?, ?)", int64_t{-7}, std::optional<double>()).ok());
  auto select = database_->Prepare("SELECT a, b FROM t ORDER BY rowid");
  ASSERT_TRUE(*select->Step());
  EXPECT_EQ(select->Blob(0), bytes);
  EXPECT_EQ(select->Text(1), bytes);
  ASSERT_TRUE(*select->Step());
  EXPECT_EQ(select->Double(0), 1.5);
  EXPECT_FALSE(select->IsNull(1));
  EXPECT_EQ(select->Text(1), "");
  ASSERT_TRUE(*select->Step());
  EXPECT_EQ(select->Int64(0), -7);
  EXPECT_EQ(select->Double(0), -7);
  EXPECT_TRUE(select->IsNull(1));
  EXPECT_EQ(select->OptionalDouble(1), std::nullopt);
  EXPECT_TRUE(select->row_status().ok());
  EXPECT_FALSE(*select->Step());
}

TEST_F(SqliteTest, ColumnOfAnotherTypeIsDamage) {
  ASSERT_TRUE(database_->Run("INSERT INTO t VALUES ('text', NULL)").ok());
  auto select = database_->Prepare("SELECT a, b FROM t");
  ASSERT_TRUE(*select->Step());
  EXPECT_EQ(select->Int64(0), 0);
  EXPECT_EQ(select->Text(1), "");
  EXPECT_EQ(select->row_status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(select->row_status().message()), HasSubstr("column a holds text"));
}

TEST_F(SqliteTest, OneStatementIsLentTwiceAtOnce) {
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(database_->Run("INSERT INTO t VALUES (?, ?)", i).ok());
  int pairs = 0;
  auto outer = database_->Prepare("SELECT a FROM t");
  while (*outer->Step()) {
    auto inner = database_->Prepare("SELECT a FROM t");
    while (*inner->Step()) ++pairs;
  }
  EXPECT_EQ(pairs, 9);
}

// The prepared statements of a connection.
std::vector<sqlite3_stmt*> StatementsOf(Database& database) {
  std::vector<sqlite3_stmt*> statements;
  sqlite3_stmt* next = nullptr;
  while ((next = sqlite3_next_stmt(database.handle(), next)) != nullptr) statements.push_back(next);
  return statements;
}

TEST_F(SqliteTest, StatementsThatAreNotUsedAreFreed) {
  const std::string often = "SELECT count(*) FROM t";
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(**database_->QueryInt64(absl::StrCat("SELECT ", i)), i);
    ASSERT_TRUE(database_->QueryInt64(often).ok());
  }
  EXPECT_EQ(StatementsOf(*database_).size(), Database::kMaxIdleStatements);
  // The one that is used again and again was prepared once.
  int runs = 0;
  for (sqlite3_stmt* stmt : StatementsOf(*database_)) {
    if (often == sqlite3_sql(stmt)) runs += sqlite3_stmt_status(stmt, SQLITE_STMTSTATUS_RUN, 0);
  }
  EXPECT_EQ(runs, 1000);
  database_->ForgetStatements();
  EXPECT_TRUE(StatementsOf(*database_).empty());
}

TEST_F(SqliteTest, AnyNumberOfStatementsIsLentAtOnce) {
  std::vector<Statement> lent;
  for (int i = 0; i < 200; ++i) lent.push_back(*database_->Prepare(absl::StrCat("SELECT ", i)));
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(*lent[i].Step());
    EXPECT_EQ(lent[i].Int64(0), i);
  }
  lent.clear();
  EXPECT_EQ(StatementsOf(*database_).size(), Database::kMaxIdleStatements);
}

TEST_F(SqliteTest, StatementComesBackWithoutItsBindings) {
  ASSERT_TRUE(database_->Run("INSERT INTO t VALUES (?, ?)", 1, "x").ok());
  ASSERT_TRUE(database_->Run("INSERT INTO t VALUES (?, ?)", 1).ok());
  EXPECT_EQ(**database_->QueryInt64("SELECT count(*) FROM t WHERE b IS NULL"), 1);
}

TEST_F(SqliteTest, TransactionThatIsNotCommittedIsUndone) {
  {
    auto transaction = Transaction::Begin(database_.get());
    ASSERT_TRUE(database_->Run("INSERT INTO t VALUES (1, 'a')").ok());
    EXPECT_EQ(Count(), 1);
  }
  EXPECT_EQ(Count(), 0);
  auto transaction = Transaction::Begin(database_.get());
  ASSERT_TRUE(database_->Run("INSERT INTO t VALUES (1, 'a')").ok());
  ASSERT_TRUE(transaction->Commit().ok());
  EXPECT_EQ(Count(), 1);
}

TEST_F(SqliteTest, ErrorsBecomeTheStatusThatCallersActOn) {
  ASSERT_TRUE(database_->Run("INSERT INTO t VALUES (1, 'a')").ok());
  EXPECT_EQ(database_->Run("INSERT INTO t VALUES (1, 'a')").code(), absl::StatusCode::kInternal);
  EXPECT_EQ(database_->Execute("no SQL").code(), absl::StatusCode::kInternal);
  EXPECT_EQ(Database::Open(folder_ / "none", Database::OpenMode::kExisting, absl::ZeroDuration())
                .status()
                .code(),
            absl::StatusCode::kFailedPrecondition);

  const auto other = Connect(folder_ / "test.sqlite");
  {
    auto transaction = Transaction::Begin(other.get());
    EXPECT_EQ(Transaction::Begin(database_.get()).status().code(), absl::StatusCode::kUnavailable);
  }

  folder_.Write("text", std::string(1000, 'x'));
  EXPECT_EQ(Connect(folder_ / "text")->QueryInt64("SELECT 1 FROM t").status().code(),
            absl::StatusCode::kFailedPrecondition);

  ASSERT_TRUE(database_->Execute("PRAGMA max_page_count = 10").ok());
  EXPECT_EQ(database_->Run("INSERT INTO t VALUES (zeroblob(1000000), 'b')").code(),
            absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace hypermap::storage
