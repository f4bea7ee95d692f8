#include "storage/geopackage/fusion_tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "storage/conformance/testing/edited_map.h"
#include "storage/conformance/testing/evidence_map.h"
#include "storage/encoding/packed_bytes.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

class FusionTablesTest : public ::testing::Test {
 protected:
  FusionTablesTest() : store_(OpenStore(folder_.path())), map_(CreateMap(*store_, "site")) {}

  testing::TemporaryFolder folder_;
  std::unique_ptr<MapStore> store_;
  EvidenceMap map_;
};

// The number of steps of SQLite's virtual machine that `work` takes on a connection.
template <typename Work>
int64_t StepsOf(Database* database, Work work) {
  int64_t steps = 0;
  const auto count = [](void* counted) {
    ++*static_cast<int64_t*>(counted);
    return 0;
  };
  sqlite3_progress_handler(database->handle(), 1, count, &steps);
  work();
  sqlite3_progress_handler(database->handle(), 0, nullptr, nullptr);
  return steps;
}

TEST_F(FusionTablesTest, NewestStampOfARobotThatSentLittleDoesNotReadTheLayer) {
  map_.WriteObservations("old", {7}, 1);
  map_.WriteObservations("retracted", {7}, 2);
  map_.WriteObservations("busy", EveryNth(1, 2000), 1000);
  map_.WriteObservations("new", {7}, 9000);
  map_.Write({.layer = "things", .retracted = {Key(2, "retracted", 7)}});
  const auto connection = Connect(folder_ / "site.gpkg");
  FusionTables tables(connection.get());
  // Prepares the statements.
  ASSERT_TRUE(tables.NewestStamp("things", "old").ok());
  const std::pair<const char*, std::optional<absl::Time>> answers[] = {
      {"old", absl::FromUnixNanos(1)},
      {"retracted", std::nullopt},
      {"busy", absl::FromUnixNanos(2999)},
      {"new", absl::FromUnixNanos(9000)},
      {"never", std::nullopt},
  };
  for (const auto& [robot, newest] : answers) {
    SCOPED_TRACE(robot);
    absl::StatusOr<std::optional<absl::Time>> answer;
    const std::string name = robot;
    EXPECT_LT(StepsOf(connection.get(), [&] { answer = tables.NewestStamp("things", name); }), 200);
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(*answer, newest);
  }
}

TEST_F(FusionTablesTest, ForgottenSequencesAreStoredAsRanges) {
  constexpr int64_t kLast = std::numeric_limits<int64_t>::max();
  map_.WriteObservations("a", {3, 0, 7, 1, 8, kLast, 2}, 1);
  map_.WriteObservations("b", {5}, 3);
  const LogKey base{Key(7, "a", 2), 0};
  ASSERT_TRUE(map_.log().KeepCheckpoint("things", {base, "state", {}}, {}).ok());
  ASSERT_TRUE(map_.log().MoveBase("things", base).ok());
  // A few rows at a time: later ones join the ranges of earlier ones.
  while (*map_.stored().Compact(0, absl::InfinitePast(), 3)) {
  }
  const auto other = Connect(folder_ / "site.gpkg");
  EXPECT_EQ(**other->QueryInt64("SELECT count(*) FROM hypermap_forgotten_sequences"), 4);
}

TEST_F(FusionTablesTest, DamagedBaseIsTold) {
  map_.Write({.layer = "things", .settings = FusionSettings{"evidence", "{}", ""}});
  ASSERT_TRUE(map_.log().KeepCheckpoint("things", {{Key(1, "a", 1), 0}, "state", {}}, {}).ok());
  ASSERT_TRUE(map_.log().MoveBase("things", {Key(1, "a", 1), 0}).ok());
  const auto other = Connect(folder_ / "site.gpkg");
  for (const char* damage : {"state = X'00'", "state_size = 4", "robot = X'00'"}) {
    SCOPED_TRACE(damage);
    ASSERT_TRUE(other->Execute(std::string("UPDATE hypermap_fusion_bases SET ") + damage).ok());
    const absl::Status status = map_.log().FindBase("things").status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
    EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("hypermap_fusion_bases"));
    const std::string whole = PackBytes("state");
    ASSERT_TRUE(other
                    ->Run("UPDATE hypermap_fusion_bases SET robot = 'a', state_size = 5, state = ?",
                          BlobView{whole})
                    .ok());
  }
}

TEST_F(FusionTablesTest, DamageIsTold) {
  map_.Write({.layer = "things",
              .settings = FusionSettings{"evidence", "{}", ""},
              .observations = {Logged(Key(1, "a", 0), std::string(1000, 'x'))}});
  const auto other = Connect(folder_ / "site.gpkg");
  for (const char* damage : {"body_size = 999", "body_size = 1000000000", "body = X'00'",
                             "body_size = -1", "body = 'text'", "robot = X'00'"}) {
    SCOPED_TRACE(damage);
    ASSERT_TRUE(other->Execute(std::string("UPDATE hypermap_observations SET ") + damage).ok());
    const absl::Status status = map_.log().Read("things", BeforeAll(), 10).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
    EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("hypermap_observations"));
    const std::string whole = PackBytes(std::string(1000, 'x'));
    ASSERT_TRUE(other
                    ->Run("UPDATE hypermap_observations SET robot = 'a', body_size = 1000, "
                          "body = ?",
                          BlobView{whole})
                    .ok());
  }
}

TEST(PackedBytes, ComeBackAndDamageIsTold) {
  for (const std::string& bytes :
       {std::string(), std::string("a"), std::string(100'000, 'z'), std::string("\0\xff", 2)}) {
    const std::string packed = PackBytes(bytes);
    EXPECT_EQ(*UnpackBytes(packed, static_cast<int64_t>(bytes.size())), bytes);
    EXPECT_EQ(UnpackBytes(packed, static_cast<int64_t>(bytes.size()) + 1).status().code(),
              absl::StatusCode::kDataLoss);
    EXPECT_EQ(UnpackBytes(packed.substr(0, packed.size() - 1), bytes.size()).status().code(),
              absl::StatusCode::kDataLoss);
  }
  EXPECT_EQ(UnpackBytes("", int64_t{1} << 40).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace hypermap::storage
