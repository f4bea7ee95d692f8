#include "storage/geopackage/fusion_tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/cancellation/testing/cancelled_after.h"
#include "base/metering/memory_meter.h"
#include "storage/geopackage/packed_bytes.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;

ObservationKey Key(int64_t nanos, const std::string& robot, int64_t sequence) {
  return {absl::FromUnixNanos(nanos), robot, sequence};
}

LoggedObservation Logged(const ObservationKey& key, const std::string& body) {
  return {key, 0xfedcba9876543210, absl::FromUnixNanos(99), body};
}

class FusionTablesTest : public ::testing::Test {
 protected:
  FusionTablesTest() : store_(OpenStore(folder_.path())), map_(CreateMap(*store_, "site")) {
    map_.Edit({{CreateLayer{SemanticSpec("things")}, CreateLayer{SemanticSpec("others")}}});
  }

  FusionLog& log() { return map_.stored->fusion_log(); }

  void Write(FusionChange change, const EditBatch& batch = {}) {
    Commit commit = batch.edits.empty()
                        ? MakeCommit(*map_.snapshot, {{PutObject{"others", UnitSquare("cup"), ""}}})
                        : MakeCommit(*map_.snapshot, batch);
    if (!change.layer.empty()) commit.fusion.push_back(std::move(change));
    const absl::Status status = map_.stored->Write({commit});
    ASSERT_TRUE(status.ok()) << status;
    map_.snapshot = commit.applied.snapshot;
  }

  std::vector<std::string> Bodies(const LogKey& after, int max_entries = 100) {
    const auto entries = log().Read("things", after, max_entries);
    EXPECT_TRUE(entries.ok()) << entries.status();
    std::vector<std::string> bodies;
    for (const LogEntry& entry : *entries) bodies.push_back(entry.body);
    return bodies;
  }

  // Removes all rows that are not needed.
  void Compact() {
    while (*map_.stored->Compact(0, absl::InfinitePast(), 100)) {
    }
  }

  // Adds an observation of `robot` for each sequence, with stamps from `first_ns` on.
  void WriteObservations(const std::string& robot, const std::vector<int64_t>& sequences,
                         int64_t first_ns) {
    FusionChange change{.layer = "things", .settings = FusionSettings{"evidence", "{}", ""}};
    for (const int64_t sequence : sequences) {
      change.observations.push_back(Logged(Key(first_ns++, robot, sequence), "body"));
    }
    Write(std::move(change));
  }

  testing::TemporaryFolder folder_;
  std::unique_ptr<MapStore> store_;
  EditedMap map_;
};

TEST_F(FusionTablesTest, EntriesComeInTheOrderOfTheirKeysWhateverTheyWereWrittenIn) {
  Write({.layer = "things",
         .settings = FusionSettings{"evidence", "{}", ""},
         .observations = {Logged(Key(20, "b", 1), "3"), Logged(Key(-5, "z", 9), "0")}});
  Write({.layer = "things",
         .observations = {Logged(Key(20, "a", 7), "2"), Logged(Key(20, "b", 2), "6")},
         .facts = {{{Key(20, "b", 1), 2}, "remove", "t", "5"},
                   {{Key(20, "b", 1), 1}, "pin", "t", "4"},
                   {{BeforeAll().after, 3}, "pin", "t", "first"}}});
  Write({.layer = "others",
         .settings = FusionSettings{"paper", "{}", ""},
         .observations = {Logged(Key(20, "b", 1), "of others")}});
  EXPECT_THAT(Bodies(BeforeAll()), ElementsAre("first", "0", "2", "3", "4", "5", "6"));
  EXPECT_THAT(Bodies(BeforeAll(), 3), ElementsAre("first", "0", "2"));
  EXPECT_THAT(Bodies({Key(20, "a", 7), 0}), ElementsAre("3", "4", "5", "6"));
  EXPECT_THAT(Bodies({Key(20, "b", 1), 0}, 2), ElementsAre("4", "5"));
  EXPECT_THAT(Bodies({Key(20, "b", 1), 1}), ElementsAre("5", "6"));
  EXPECT_EQ(*log().NewestKey("things"), Key(20, "b", 2));
  EXPECT_EQ(*log().NewestFact("things"), (LogKey{Key(20, "b", 1), 2}));
  EXPECT_EQ((**log().FindObservation("things", "b", 1)).content_hash, 0xfedcba9876543210);
  EXPECT_EQ(*log().FindObservation("things", "b", 9), std::nullopt);
  EXPECT_THAT(*log().Sequences("things", "b"), ElementsAre(SequenceRange{1, 2}));
}

TEST_F(FusionTablesTest, C2NewestStampIsOfOneRobotAndNotRetracted) {
  EXPECT_EQ(*log().NewestStamp("things", "a"), std::nullopt);
  Write({.layer = "things",
         .settings = FusionSettings{"evidence", "{}", ""},
         .observations = {Logged(Key(-5, "a", 1), "1"), Logged(Key(30, "a", 2), "2"),
                          Logged(Key(20, "a", 3), "3"), Logged(Key(99, "b", 1), "4")}});
  Write({.layer = "others",
         .settings = FusionSettings{"paper", "{}", ""},
         .observations = {Logged(Key(200, "a", 1), "of others")}});
  EXPECT_EQ(*log().NewestStamp("things", "a"), absl::FromUnixNanos(30));
  EXPECT_EQ(*log().NewestStamp("things", "b"), absl::FromUnixNanos(99));
  EXPECT_EQ(*log().NewestStamp("things", "c"), std::nullopt);
  Write({.layer = "things", .retracted = {Key(30, "a", 2), Key(99, "b", 1)}});
  EXPECT_EQ(*log().NewestStamp("things", "a"), absl::FromUnixNanos(20));
  EXPECT_EQ(*log().NewestStamp("things", "b"), std::nullopt);
}

std::vector<int64_t> EveryNth(int64_t step, int64_t count) {
  std::vector<int64_t> sequences;
  for (int64_t i = 0; i < count; ++i) sequences.push_back(step * i);
  return sequences;
}

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
  WriteObservations("old", {7}, 1);
  WriteObservations("retracted", {7}, 2);
  WriteObservations("busy", EveryNth(1, 2000), 1000);
  WriteObservations("new", {7}, 9000);
  Write({.layer = "things", .retracted = {Key(2, "retracted", 7)}});
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

TEST_F(FusionTablesTest, SequencesAreMeteredByTheirRangesAndGivenUp) {
  constexpr int64_t kCount = 3000;
  WriteObservations("sparse", EveryNth(2, kCount), 0);
  WriteObservations("dense", EveryNth(1, kCount), 0);
  {
    MemoryCap cap("max_request_bytes", 1 << 10);
    MemoryMeter meter(&cap);
    const ScopedMeter here(&meter);
    EXPECT_THAT(*log().Sequences("things", "dense"), ElementsAre(SequenceRange{0, kCount - 1}));
    const absl::Status status = log().Sequences("things", "sparse").status();
    EXPECT_TRUE(absl::IsResourceExhausted(status)) << status;
    EXPECT_THAT(std::string(status.message()), ::testing::StartsWith("takes more than"));
  }
  EXPECT_THAT(*log().Sequences("things", "sparse"), ::testing::SizeIs(kCount));
  EXPECT_GT(TimesCancelled([&] { return log().Sequences("things", "dense").status(); }), 3);
}

TEST_F(FusionTablesTest, RetractedObservationsAreKnownAndNotRead) {
  Write({.layer = "things",
         .settings = FusionSettings{"evidence", "{}", ""},
         .observations = {Logged(Key(1, "a", 0), "0"), Logged(Key(2, "a", 1), "1"),
                          Logged(Key(3, "a", 2), "2")}});
  EXPECT_THAT(*log().KeysOf("things", "a", absl::FromUnixNanos(2), absl::FromUnixNanos(3)),
              ElementsAre(Key(2, "a", 1)));
  Write({.layer = "things", .retracted = {Key(2, "a", 1), Key(3, "a", 2)}});
  EXPECT_THAT(Bodies(BeforeAll()), ElementsAre("0"));
  EXPECT_THAT(*log().KeysOf("things", "a", absl::InfinitePast(), absl::InfiniteFuture()),
              ElementsAre(Key(1, "a", 0)));
  EXPECT_TRUE((**log().FindObservation("things", "a", 1)).retracted);
  EXPECT_EQ(*log().NewestKey("things"), Key(1, "a", 0));
  EXPECT_THAT(*log().Sequences("things", "a"), ElementsAre(SequenceRange{0, 2}));
}

TEST_F(FusionTablesTest, OnlyCheckpointsThatAreTrueAndNewAreFound) {
  Write({.layer = "things", .settings = FusionSettings{"evidence", "{}", ""}});
  for (int i = 1; i <= 6; ++i) {
    const std::string state(1000 * i, static_cast<char>('0' + i));
    std::vector<LogKey> dropped;
    if (i > 4) dropped.push_back({Key(i - 4, "a", i - 4), 0});
    ASSERT_TRUE(log().KeepCheckpoint("things", {{Key(i, "a", i), 0}, state, {}}, dropped).ok());
  }
  const LogKey third{Key(3, "a", 3), 0};
  EXPECT_EQ(log().Checkpoints("things")->size(), 4u);
  EXPECT_EQ(log().Checkpoints("things")->front().key, third);
  EXPECT_EQ((**log().FindCheckpoint("things", std::nullopt)).state, std::string(6000, '6'));
  EXPECT_EQ((**log().FindCheckpoint("things", LogKey{Key(4, "a", 4), 0})).state,
            std::string(3000, '3'));
  EXPECT_EQ(*log().FindCheckpoint("things", LogKey{Key(3, "a", 3), 0}), std::nullopt);
  Write({.layer = "things", .stale_from = LogKey{Key(5, "a", 5), 0}});
  EXPECT_EQ((**log().FindCheckpoint("things", std::nullopt)).state, std::string(4000, '4'));
  EXPECT_EQ(log().Checkpoints("things")->size(), 2u);
  EXPECT_EQ(log().Checkpoints("things")->front().key, third);
}

TEST_F(FusionTablesTest, DeletedLayerLeavesNothing) {
  for (const char* layer : {"things", "others"}) {
    Write({.layer = layer,
           .settings = FusionSettings{"evidence", "{}", ""},
           .observations = {Logged(Key(1, "a", 0), layer)},
           .facts = {{{Key(1, "a", 0), 1}, "pin", "t", "x"}},
           .tracks = {{"t", 1}}});
    ASSERT_TRUE(log().KeepCheckpoint(layer, {{Key(1, "a", 0), 0}, "state", {}}, {}).ok());
    ASSERT_TRUE(log().MoveBase(layer, {Key(1, "a", 0), 0}).ok());
    Compact();
    ASSERT_TRUE(log().KeepCheckpoint(layer, {{Key(2, "a", 0), 0}, "state", {}}, {}).ok());
  }
  Write({}, {{DeleteLayer{"things"}}});
  EXPECT_TRUE(Bodies(BeforeAll()).empty());
  EXPECT_TRUE(log().Tracks("things")->empty());
  EXPECT_EQ(*log().FindCheckpoint("things", std::nullopt), std::nullopt);
  EXPECT_EQ(*log().FindBase("things"), std::nullopt);
  EXPECT_FALSE(*log().HasForgotten("things", "a"));
  EXPECT_EQ(log().FusedLayers()->size(), 1u);
  EXPECT_EQ(log().Tracks("others")->size(), 1u);
  EXPECT_NE(*log().FindBase("others"), std::nullopt);
  EXPECT_TRUE(*log().HasForgotten("others", "a"));
}

TEST_F(FusionTablesTest, BaseIsTheNewestOfTheCheckpointsThatAreOldEnough) {
  Write({.layer = "things",
         .settings = FusionSettings{"evidence", "{}", ""},
         .facts = {{{BeforeAll().after, 1}, "pin", "t", "first"},
                   {{Key(2, "a", 2), 2}, "pin", "t", "second"},
                   {{Key(3, "a", 3), 3}, "pin", "t", "third"}}});
  const auto keep = [&](const LogKey& key, const std::string& state, int64_t stored_at_ns) {
    ASSERT_TRUE(
        log().KeepCheckpoint("things", {key, state, absl::FromUnixNanos(stored_at_ns)}, {}).ok());
  };
  const auto move = [&](int64_t before_ns) -> std::optional<LogKey> {
    const auto next = log().FindNextBase("things", absl::FromUnixNanos(before_ns));
    EXPECT_TRUE(next.ok()) << next.status();
    if (!next.ok() || !*next) return std::nullopt;
    EXPECT_TRUE(log().MoveBase("things", (*next)->key).ok());
    return (*next)->key;
  };
  keep({BeforeAll().after, 1}, "before all observations", 10);
  EXPECT_EQ(move(99), std::nullopt);
  keep({Key(1, "a", 1), 0}, "1", 30);  // stored again later than those after it
  keep({Key(2, "a", 2), 2}, "2", 20);
  keep({Key(4, "a", 4), 0}, "4", 40);
  EXPECT_EQ(move(20), std::nullopt);
  EXPECT_EQ(*log().FindBase("things"), std::nullopt);
  EXPECT_EQ(move(40), (LogKey{Key(2, "a", 2), 2}));
  auto base = *log().FindBase("things");
  ASSERT_TRUE(base);
  EXPECT_EQ(base->key, (LogKey{Key(2, "a", 2), 2}));
  EXPECT_EQ(base->state, "2");
  EXPECT_EQ(base->num_facts, 2);
  EXPECT_EQ(log().Checkpoints("things")->size(), 1u);
  EXPECT_EQ(move(40), std::nullopt);
  EXPECT_EQ(*log().FindBase("others"), std::nullopt);

  Compact();
  EXPECT_THAT(Bodies(BeforeAll()), ElementsAre("third"));
  // The base counts the facts although their rows are gone.
  EXPECT_EQ(move(41), (LogKey{Key(4, "a", 4), 0}));
  Compact();
  EXPECT_TRUE(Bodies(BeforeAll()).empty());
  EXPECT_EQ(*log().NewestFact("things"), std::nullopt);
  keep({Key(5, "a", 5), 0}, "5", 50);
  EXPECT_EQ(move(51), (LogKey{Key(5, "a", 5), 0}));
  base = *log().FindBase("things");
  ASSERT_TRUE(base);
  EXPECT_EQ(base->num_facts, 3);
}

TEST_F(FusionTablesTest, NamesOfForgottenObservationsAreKept) {
  constexpr int64_t kLast = std::numeric_limits<int64_t>::max();
  // The order of the stamps is not that of the sequences.
  WriteObservations("a", {3, 0, 7, 1, 8, kLast, 2, 9}, 1);
  WriteObservations("b", {5}, 3);
  Write({.layer = "things", .retracted = {Key(3, "a", 7)}});
  const LogKey base{Key(7, "a", 2), 0};
  ASSERT_TRUE(log().KeepCheckpoint("things", {base, "state", {}}, {}).ok());
  EXPECT_FALSE(*log().HasForgotten("things", "a"));
  ASSERT_TRUE(log().MoveBase("things", base).ok());
  const auto expect_known = [&] {
    EXPECT_TRUE(*log().HasForgotten("things", "a"));
    EXPECT_TRUE(*log().HasForgotten("things", "b"));
    EXPECT_FALSE(*log().HasForgotten("things", "c"));
    EXPECT_FALSE(*log().HasForgotten("others", "a"));
    EXPECT_THAT(*log().Sequences("things", "a"),
                ElementsAre(SequenceRange{0, 3}, SequenceRange{7, 9}, SequenceRange{kLast, kLast}));
    EXPECT_THAT(*log().Sequences("things", "b"), ElementsAre(SequenceRange{5, 5}));
    for (const int64_t sequence : {int64_t{0}, int64_t{3}, int64_t{7}, int64_t{9}, kLast}) {
      EXPECT_NE(*log().FindObservation("things", "a", sequence), std::nullopt) << sequence;
    }
    for (const int64_t sequence : {int64_t{-1}, int64_t{4}, int64_t{6}, int64_t{10}, kLast - 1}) {
      EXPECT_EQ(*log().FindObservation("things", "a", sequence), std::nullopt) << sequence;
    }
    EXPECT_THAT(Bodies(base), ElementsAre("body"));
  };
  expect_known();
  // A few rows at a time: names are known at every moment.
  for (int step = 0; *map_.stored->Compact(0, absl::InfinitePast(), 3); ++step) {
    ASSERT_LT(step, 10);
    expect_known();
  }
  expect_known();
  EXPECT_THAT(Bodies(BeforeAll()), ElementsAre("body"));
  EXPECT_EQ((**log().FindObservation("things", "a", 8)).content_hash, std::nullopt);
  EXPECT_EQ((**log().FindObservation("things", "a", 9)).content_hash, 0xfedcba9876543210);
  const auto other = Connect(folder_ / "site.gpkg");
  EXPECT_EQ(**other->QueryInt64("SELECT count(*) FROM hypermap_forgotten_sequences"), 4);
}

TEST_F(FusionTablesTest, BaseMovesToACheckpointOnly) {
  Write({.layer = "things", .settings = FusionSettings{"evidence", "{}", ""}});
  EXPECT_FALSE(log().MoveBase("things", {Key(1, "a", 1), 0}).ok());
  EXPECT_EQ(*log().FindBase("things"), std::nullopt);
}

TEST_F(FusionTablesTest, DamagedBaseIsTold) {
  Write({.layer = "things", .settings = FusionSettings{"evidence", "{}", ""}});
  ASSERT_TRUE(log().KeepCheckpoint("things", {{Key(1, "a", 1), 0}, "state", {}}, {}).ok());
  ASSERT_TRUE(log().MoveBase("things", {Key(1, "a", 1), 0}).ok());
  const auto other = Connect(folder_ / "site.gpkg");
  for (const char* damage : {"state = X'00'", "state_size = 4", "robot = X'00'"}) {
    SCOPED_TRACE(damage);
    ASSERT_TRUE(other->Execute(std::string("UPDATE hypermap_fusion_bases SET ") + damage).ok());
    const absl::Status status = log().FindBase("things").status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
    EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("hypermap_fusion_bases"));
    const std::string whole = PackBytes("state");
    ASSERT_TRUE(other
                    ->Run("UPDATE hypermap_fusion_bases SET robot = 'a', state_size = 5, state = ?",
                          BlobView{whole})
                    .ok());
  }
}

TEST_F(FusionTablesTest, FailedCommitStoresNoEvidence) {
  FusionChange change{.layer = "things",
                      .settings = FusionSettings{"evidence", "{}", ""},
                      .observations = {Logged(Key(1, "a", 0), "0"), Logged(Key(2, "a", 0), "1")}};
  Commit commit = MakeCommit(*map_.snapshot, {{PutObject{"others", UnitSquare("cup"), ""}}});
  commit.fusion.push_back(change);
  EXPECT_FALSE(map_.stored->Write({commit}).ok());
  EXPECT_TRUE(log().FusedLayers()->empty());
  EXPECT_TRUE(Bodies(BeforeAll()).empty());
}

TEST_F(FusionTablesTest, DamageIsTold) {
  Write({.layer = "things",
         .settings = FusionSettings{"evidence", "{}", ""},
         .observations = {Logged(Key(1, "a", 0), std::string(1000, 'x'))}});
  const auto other = Connect(folder_ / "site.gpkg");
  for (const char* damage : {"body_size = 999", "body_size = 1000000000", "body = X'00'",
                             "body_size = -1", "body = 'text'", "robot = X'00'"}) {
    SCOPED_TRACE(damage);
    ASSERT_TRUE(other->Execute(std::string("UPDATE hypermap_observations SET ") + damage).ok());
    const absl::Status status = log().Read("things", BeforeAll(), 10).status();
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
