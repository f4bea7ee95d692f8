#include "storage/postgres/owned_map.h"

#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/libpq/testing/cluster.h"
#include "storage/postgres/map_row.h"
#include "storage/postgres/testing/database.h"

namespace hypermap::storage::postgres {
namespace {

using ::testing::HasSubstr;

// Each write adds a row with a number.
class OwnedMapTest : public ::testing::Test {
 protected:
  void SetUp() override {
    HYPERMAP_SKIP_WITHOUT_POSTGRES();
    database_ = NewDatabase();
    Execute(database_, "CREATE TABLE written (number bigint)");
    connection_ = Connect(database_);
    row_ = AddMap(connection_.get(), "site", "a");
    owned_ = Own(row_);
  }

  std::unique_ptr<OwnedMap> Own(const OwnedMap::Row& row) const {
    ConnectOptions options;
    options.target = database_;
    return std::make_unique<OwnedMap>(options, row);
  }
  // Another server takes the map.
  OwnedMap::Row Take() {
    const auto found = FindMap(connection_.get(), "site");
    EXPECT_TRUE(found.ok() && *found);
    const auto row = TakeMap(connection_.get(), **found, "b");
    EXPECT_TRUE(row.ok()) << row.status();
    return *row;
  }
  static absl::Status Write(OwnedMap& map, int number) {
    return map.Write([number](Pipeline& pipeline) {
      pipeline.Add("INSERT INTO written (number) VALUES ($1)", number);
      return absl::OkStatus();
    });
  }
  int64_t CountWritten(int number) const {
    return QueryNumber(database_,
                       absl::StrCat("SELECT count(*) FROM written WHERE number = ", number));
  }

  std::string database_;
  std::unique_ptr<Connection> connection_;
  OwnedMap::Row row_;
  std::unique_ptr<OwnedMap> owned_;
};

TEST_F(OwnedMapTest, OwnerThatWasReplacedWritesNothingMore) {
  ASSERT_TRUE(Write(*owned_, 1).ok());
  const std::unique_ptr<OwnedMap> next = Own(Take());
  const absl::Status refused = Write(*owned_, 2);
  EXPECT_TRUE(absl::IsDataLoss(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("server b owns the map"));
  EXPECT_EQ(owned_->lost(), refused);
  EXPECT_TRUE(absl::IsDataLoss(Write(*owned_, 3)));
  EXPECT_TRUE(Write(*next, 4).ok());
  EXPECT_EQ(CountWritten(2) + CountWritten(3), 0);
  EXPECT_EQ(CountWritten(4), 1);
}

TEST_F(OwnedMapTest, CommitWhoseAnswerIsLostIsFoundToBeStored) {
  const absl::Status status = owned_->Write([](Pipeline& pipeline) {
    pipeline.Add("INSERT INTO written (number) VALUES (1)");
    pipeline.Add("COMMIT");
    pipeline.Add("SELECT pg_terminate_backend(pg_backend_pid())");
    return absl::OkStatus();
  });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(CountWritten(1), 1);
  EXPECT_TRUE(Write(*owned_, 2).ok());
}

TEST_F(OwnedMapTest, TransactionThatIsLostIsFoundNotToBeStored) {
  const absl::Status status = owned_->Write([](Pipeline& pipeline) {
    pipeline.Add("INSERT INTO written (number) VALUES (1)");
    pipeline.Add("SELECT pg_terminate_backend(pg_backend_pid())");
    return absl::OkStatus();
  });
  EXPECT_TRUE(absl::IsUnavailable(status)) << status;
  EXPECT_EQ(CountWritten(1), 0);
  EXPECT_TRUE(owned_->lost().ok()) << owned_->lost();
  EXPECT_TRUE(Write(*owned_, 1).ok());
  EXPECT_EQ(CountWritten(1), 1);
}

TEST_F(OwnedMapTest, OutcomeThatIsUnknownAfterATakeoverEndsTheMap) {
  const absl::Status status = owned_->Write([this](Pipeline& pipeline) {
    Take();
    pipeline.Add("SELECT pg_terminate_backend(pg_backend_pid())");
    return absl::OkStatus();
  });
  EXPECT_TRUE(absl::IsDataLoss(status)) << status;
  EXPECT_TRUE(absl::IsDataLoss(Write(*owned_, 2)));
}

TEST_F(OwnedMapTest, SessionThatComesTooLateCommitsNothing) {
  // An earlier session has the statements of a transaction, and has not carried them out when the
  // owner asks for its outcome.
  const int64_t before = QueryNumber(database_, "SELECT last_write FROM hypermap.maps");
  const absl::Status lost = owned_->Write([](Pipeline& pipeline) {
    pipeline.Add("SELECT pg_terminate_backend(pg_backend_pid())");
    return absl::OkStatus();
  });
  EXPECT_TRUE(absl::IsUnavailable(lost)) << lost;
  EXPECT_EQ(QueryNumber(database_, absl::StrCat("SELECT count(*) FROM hypermap.maps WHERE "
                                                "last_write = ",
                                                before)),
            0);
  // With the number that it saw the session can't advance the row any more.
  const std::unique_ptr<OwnedMap> late = Own(row_);
  EXPECT_TRUE(absl::IsDataLoss(Write(*late, 1)));
  EXPECT_EQ(CountWritten(1), 0);
  EXPECT_TRUE(Write(*owned_, 2).ok());
}

TEST_F(OwnedMapTest, FailedStatementStoresNothingAndTheMapGoesOn) {
  const absl::Status status = owned_->Write([](Pipeline& pipeline) {
    pipeline.Add("INSERT INTO written (number) VALUES (1)");
    pipeline.Add("SELECT 1 / 0");
    return absl::OkStatus();
  });
  EXPECT_FALSE(status.ok());
  EXPECT_EQ(CountWritten(1), 0);
  const absl::Status refused = owned_->Write([](Pipeline& pipeline) {
    pipeline.Add("INSERT INTO written (number) VALUES (2)");
    return absl::InvalidArgumentError("does not fit");
  });
  EXPECT_TRUE(absl::IsInvalidArgument(refused)) << refused;
  EXPECT_EQ(CountWritten(2), 0);
  EXPECT_TRUE(Write(*owned_, 3).ok());
}

TEST_F(OwnedMapTest, RevisionIsAdvancedOnlyFromTheOneThatIsThere) {
  const auto nothing = [](Pipeline&) { return absl::OkStatus(); };
  ASSERT_TRUE(owned_->Write(nothing, OwnedMap::Advance{0, 1, 5, 2}).ok());
  EXPECT_EQ(QueryNumber(database_, "SELECT revision FROM hypermap.maps"), 1);
  EXPECT_EQ(QueryNumber(database_, "SELECT next_object_id FROM hypermap.maps"), 5);
  EXPECT_FALSE(owned_->Write(nothing, OwnedMap::Advance{0, 2, 6, 2}).ok());
  EXPECT_EQ(QueryNumber(database_, "SELECT revision FROM hypermap.maps"), 1);
}

}  // namespace
}  // namespace hypermap::storage::postgres
