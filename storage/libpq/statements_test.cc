#include "storage/libpq/statements.h"

#include "gtest/gtest.h"

namespace hypermap::storage::postgres {
namespace {

TEST(StatementsTest, BeginAndCommitAreKnown) {
  EXPECT_TRUE(IsBegin("BEGIN"));
  EXPECT_TRUE(IsBegin(" begin ISOLATION LEVEL REPEATABLE READ"));
  EXPECT_TRUE(IsBegin("START TRANSACTION"));
  EXPECT_FALSE(IsBegin("SELECT begin FROM t"));
  EXPECT_FALSE(IsBegin(""));
  EXPECT_TRUE(IsCommit("COMMIT"));
  EXPECT_TRUE(IsCommit("\n  commit;"));
  EXPECT_TRUE(IsCommit("END"));
  EXPECT_FALSE(IsCommit("SELECT CASE WHEN a THEN b END FROM t"));
}

TEST(StatementsTest, InATransactionOnlyItsEndCommits) {
  EXPECT_TRUE(MayCommit("COMMIT", true));
  EXPECT_TRUE(MayCommit("UPDATE t SET a = 1; COMMIT", true));
  EXPECT_FALSE(MayCommit("UPDATE t SET a = 1", true));
  EXPECT_FALSE(MayCommit("SELECT CASE WHEN a THEN b END FROM t", true));
  EXPECT_FALSE(MayCommit("ROLLBACK", true));
}

TEST(StatementsTest, OutsideOfATransactionAllCommitsButReading) {
  for (const char* sql : {"SELECT 1", " select 1", "WITH a AS (SELECT 1) SELECT * FROM a",
                          "SHOW jit", "VALUES (1)", "TABLE t"}) {
    EXPECT_FALSE(MayCommit(sql, false)) << sql;
  }
  for (const char* sql :
       {"UPDATE t SET a = 1", "INSERT INTO t VALUES (1)", "COMMIT", "VACUUM t",
        "WITH a AS (DELETE FROM t RETURNING *) SELECT * FROM a",
        "with a as (insert into t values (1)) select 1", "SELECT 1; DELETE FROM t", "BEGIN",
        "BEGIN; SELECT 1; COMMIT", "CREATE TABLE t (a int)", "-- SELECT\nDROP TABLE t"}) {
    EXPECT_TRUE(MayCommit(sql, false)) << sql;
  }
}

}  // namespace
}  // namespace hypermap::storage::postgres
