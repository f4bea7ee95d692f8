// The log of evidence of fused layers.
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/cancellation/testing/cancelled_after.h"
#include "base/metering/memory_meter.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/contract.h"
#include "storage/conformance/testing/evidence_map.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class FusionLogContract : public StoreContract {
 protected:
  FusionLogContract() : map_(CreateMap(*store_, "site")) {}

  EvidenceMap map_;
};

HYPERMAP_CONFORMANCE_SUITE(FusionLogContract);

TEST_P(FusionLogContract, EntriesComeInTheOrderOfTheirKeysWhateverTheyWereWrittenIn) {
  map_.Write({.layer = "things",
              .settings = FusionSettings{"evidence", "{}", ""},
              .observations = {Logged(Key(20, "b", 1), "3"), Logged(Key(-5, "z", 9), "0")}});
  map_.Write({.layer = "things",
              .observations = {Logged(Key(20, "a", 7), "2"), Logged(Key(20, "b", 2), "6")},
              .facts = {{{Key(20, "b", 1), 2}, "remove", "t", "5"},
                        {{Key(20, "b", 1), 1}, "pin", "t", "4"},
                        {{BeforeAll().after, 3}, "pin", "t", "first"}}});
  map_.Write({.layer = "others",
              .settings = FusionSettings{"paper", "{}", ""},
              .observations = {Logged(Key(20, "b", 1), "of others")}});
  EXPECT_THAT(map_.Bodies(BeforeAll()), ElementsAre("first", "0", "2", "3", "4", "5", "6"));
  EXPECT_THAT(map_.Bodies(BeforeAll(), 3), ElementsAre("first", "0", "2"));
  EXPECT_THAT(map_.Bodies({Key(20, "a", 7), 0}), ElementsAre("3", "4", "5", "6"));
  EXPECT_THAT(map_.Bodies({Key(20, "b", 1), 0}, 2), ElementsAre("4", "5"));
  EXPECT_THAT(map_.Bodies({Key(20, "b", 1), 1}), ElementsAre("5", "6"));
  EXPECT_EQ(*map_.log().NewestKey("things"), Key(20, "b", 2));
  EXPECT_EQ(*map_.log().NewestFact("things"), (LogKey{Key(20, "b", 1), 2}));
  const auto pins = map_.log().FactsOfKind("things", "pin");
  ASSERT_TRUE(pins.ok()) << pins.status();
  ASSERT_THAT(*pins, SizeIs(2));
  EXPECT_EQ(pins->front().body, "first");
  EXPECT_EQ(pins->back().key, (LogKey{Key(20, "b", 1), 1}));
  EXPECT_EQ(pins->back().kind + pins->back().track + pins->back().body, "pint4");
  EXPECT_THAT(*map_.log().FactsOfKind("others", "pin"), IsEmpty());
  EXPECT_EQ((**map_.log().FindObservation("things", "b", 1)).content_hash, 0xfedcba9876543210);
  EXPECT_EQ(*map_.log().FindObservation("things", "b", 9), std::nullopt);
  EXPECT_THAT(*map_.log().Sequences("things", "b"), ElementsAre(SequenceRange{1, 2}));
}

TEST_P(FusionLogContract, C2NewestStampIsOfOneRobotAndNotRetracted) {
  EXPECT_EQ(*map_.log().NewestStamp("things", "a"), std::nullopt);
  map_.Write({.layer = "things",
              .settings = FusionSettings{"evidence", "{}", ""},
              .observations = {Logged(Key(-5, "a", 1), "1"), Logged(Key(30, "a", 2), "2"),
                               Logged(Key(20, "a", 3), "3"), Logged(Key(99, "b", 1), "4")}});
  map_.Write({.layer = "others",
              .settings = FusionSettings{"paper", "{}", ""},
              .observations = {Logged(Key(200, "a", 1), "of others")}});
  EXPECT_EQ(*map_.log().NewestStamp("things", "a"), absl::FromUnixNanos(30));
  EXPECT_EQ(*map_.log().NewestStamp("things", "b"), absl::FromUnixNanos(99));
  EXPECT_EQ(*map_.log().NewestStamp("things", "c"), std::nullopt);
  map_.Write({.layer = "things", .retracted = {Key(30, "a", 2), Key(99, "b", 1)}});
  EXPECT_EQ(*map_.log().NewestStamp("things", "a"), absl::FromUnixNanos(20));
  EXPECT_EQ(*map_.log().NewestStamp("things", "b"), std::nullopt);
}

TEST_P(FusionLogContract, SequencesAreMeteredByTheirRangesAndGivenUp) {
  if (GetParam().exceptions.metering) GTEST_SKIP();
  constexpr int64_t kCount = 3000;
  map_.WriteObservations("sparse", EveryNth(2, kCount), 0);
  map_.WriteObservations("dense", EveryNth(1, kCount), 0);
  {
    MemoryCap cap("max_request_bytes", 1 << 10);
    MemoryMeter meter(&cap);
    const ScopedMeter here(&meter);
    EXPECT_THAT(*map_.log().Sequences("things", "dense"),
                ElementsAre(SequenceRange{0, kCount - 1}));
    const absl::Status status = map_.log().Sequences("things", "sparse").status();
    EXPECT_TRUE(absl::IsResourceExhausted(status)) << status;
    EXPECT_THAT(std::string(status.message()), ::testing::StartsWith("takes more than"));
  }
  EXPECT_THAT(*map_.log().Sequences("things", "sparse"), SizeIs(kCount));
  EXPECT_GT(TimesCancelled([&] { return map_.log().Sequences("things", "dense").status(); }), 3);
}

TEST_P(FusionLogContract, RetractedObservationsAreKnownAndNotRead) {
  map_.Write({.layer = "things",
              .settings = FusionSettings{"evidence", "{}", ""},
              .observations = {Logged(Key(1, "a", 0), "0"), Logged(Key(2, "a", 1), "1"),
                               Logged(Key(3, "a", 2), "2")}});
  EXPECT_THAT(*map_.log().KeysOf("things", "a", absl::FromUnixNanos(2), absl::FromUnixNanos(3)),
              ElementsAre(Key(2, "a", 1)));
  map_.Write({.layer = "things", .retracted = {Key(2, "a", 1), Key(3, "a", 2)}});
  EXPECT_THAT(map_.Bodies(BeforeAll()), ElementsAre("0"));
  EXPECT_THAT(*map_.log().KeysOf("things", "a", absl::InfinitePast(), absl::InfiniteFuture()),
              ElementsAre(Key(1, "a", 0)));
  EXPECT_TRUE((**map_.log().FindObservation("things", "a", 1)).retracted);
  EXPECT_EQ(*map_.log().NewestKey("things"), Key(1, "a", 0));
  EXPECT_THAT(*map_.log().Sequences("things", "a"), ElementsAre(SequenceRange{0, 2}));
}

TEST_P(FusionLogContract, OnlyCheckpointsThatAreTrueAndNewAreFound) {
  map_.Write({.layer = "things", .settings = FusionSettings{"evidence", "{}", ""}});
  for (int i = 1; i <= 6; ++i) {
    const std::string state(1000 * i, static_cast<char>('0' + i));
    std::vector<LogKey> dropped;
    if (i > 4) dropped.push_back({Key(i - 4, "a", i - 4), 0});
    ASSERT_TRUE(
        map_.log().KeepCheckpoint("things", {{Key(i, "a", i), 0}, state, {}}, dropped).ok());
  }
  const LogKey third{Key(3, "a", 3), 0};
  EXPECT_EQ(map_.log().Checkpoints("things")->size(), 4u);
  EXPECT_EQ(map_.log().Checkpoints("things")->front().key, third);
  EXPECT_EQ((**map_.log().FindCheckpoint("things", std::nullopt)).state, std::string(6000, '6'));
  EXPECT_EQ((**map_.log().FindCheckpoint("things", LogKey{Key(4, "a", 4), 0})).state,
            std::string(3000, '3'));
  EXPECT_EQ(*map_.log().FindCheckpoint("things", LogKey{Key(3, "a", 3), 0}), std::nullopt);
  map_.Write({.layer = "things", .stale_from = LogKey{Key(5, "a", 5), 0}});
  EXPECT_EQ((**map_.log().FindCheckpoint("things", std::nullopt)).state, std::string(4000, '4'));
  EXPECT_EQ(map_.log().Checkpoints("things")->size(), 2u);
  EXPECT_EQ(map_.log().Checkpoints("things")->front().key, third);
}

TEST_P(FusionLogContract, DeletedLayerLeavesNothing) {
  for (const char* layer : {"things", "others"}) {
    map_.Write({.layer = layer,
                .settings = FusionSettings{"evidence", "{}", ""},
                .observations = {Logged(Key(1, "a", 0), layer)},
                .facts = {{{Key(1, "a", 0), 1}, "pin", "t", "x"}},
                .tracks = {{"t", 1}}});
    ASSERT_TRUE(map_.log().KeepCheckpoint(layer, {{Key(1, "a", 0), 0}, "state", {}}, {}).ok());
    ASSERT_TRUE(map_.log().MoveBase(layer, {Key(1, "a", 0), 0}).ok());
    map_.Compact();
    ASSERT_TRUE(map_.log().KeepCheckpoint(layer, {{Key(2, "a", 0), 0}, "state", {}}, {}).ok());
  }
  map_.Write({}, {{DeleteLayer{"things"}}});
  EXPECT_TRUE(map_.Bodies(BeforeAll()).empty());
  EXPECT_TRUE(map_.log().Tracks("things")->empty());
  EXPECT_EQ(*map_.log().FindCheckpoint("things", std::nullopt), std::nullopt);
  EXPECT_EQ(*map_.log().FindBase("things"), std::nullopt);
  EXPECT_FALSE(*map_.log().HasForgotten("things", "a"));
  EXPECT_EQ(map_.log().FusedLayers()->size(), 1u);
  EXPECT_EQ(map_.log().Tracks("others")->size(), 1u);
  EXPECT_NE(*map_.log().FindBase("others"), std::nullopt);
  EXPECT_TRUE(*map_.log().HasForgotten("others", "a"));
}

TEST_P(FusionLogContract, BaseIsTheNewestOfTheCheckpointsThatAreOldEnough) {
  map_.Write({.layer = "things",
              .settings = FusionSettings{"evidence", "{}", ""},
              .facts = {{{BeforeAll().after, 1}, "pin", "t", "first"},
                        {{Key(2, "a", 2), 2}, "pin", "t", "second"},
                        {{Key(3, "a", 3), 3}, "pin", "t", "third"}}});
  const auto keep = [&](const LogKey& key, const std::string& state, int64_t stored_at_ns) {
    ASSERT_TRUE(map_.log()
                    .KeepCheckpoint("things", {key, state, absl::FromUnixNanos(stored_at_ns)}, {})
                    .ok());
  };
  const auto move = [&](int64_t before_ns) -> std::optional<LogKey> {
    const auto next = map_.log().FindNextBase("things", absl::FromUnixNanos(before_ns));
    EXPECT_TRUE(next.ok()) << next.status();
    if (!next.ok() || !*next) return std::nullopt;
    EXPECT_TRUE(map_.log().MoveBase("things", (*next)->key).ok());
    return (*next)->key;
  };
  keep({BeforeAll().after, 1}, "before all observations", 10);
  EXPECT_EQ(move(99), std::nullopt);
  keep({Key(1, "a", 1), 0}, "1", 30);  // stored again later than those after it
  keep({Key(2, "a", 2), 2}, "2", 20);
  keep({Key(4, "a", 4), 0}, "4", 40);
  EXPECT_EQ(move(20), std::nullopt);
  EXPECT_EQ(*map_.log().FindBase("things"), std::nullopt);
  EXPECT_EQ(move(40), (LogKey{Key(2, "a", 2), 2}));
  auto base = *map_.log().FindBase("things");
  ASSERT_TRUE(base);
  EXPECT_EQ(base->key, (LogKey{Key(2, "a", 2), 2}));
  EXPECT_EQ(base->state, "2");
  EXPECT_EQ(base->num_facts, 2);
  EXPECT_EQ(map_.log().Checkpoints("things")->size(), 1u);
  EXPECT_EQ(move(40), std::nullopt);
  EXPECT_EQ(*map_.log().FindBase("others"), std::nullopt);

  map_.Compact();
  EXPECT_THAT(map_.Bodies(BeforeAll()), ElementsAre("third"));
  // The base counts the facts although their rows are gone.
  EXPECT_EQ(move(41), (LogKey{Key(4, "a", 4), 0}));
  map_.Compact();
  EXPECT_TRUE(map_.Bodies(BeforeAll()).empty());
  EXPECT_EQ(*map_.log().NewestFact("things"), std::nullopt);
  keep({Key(5, "a", 5), 0}, "5", 50);
  EXPECT_EQ(move(51), (LogKey{Key(5, "a", 5), 0}));
  base = *map_.log().FindBase("things");
  ASSERT_TRUE(base);
  EXPECT_EQ(base->num_facts, 3);
}

TEST_P(FusionLogContract, NamesOfForgottenObservationsAreKept) {
  constexpr int64_t kLast = std::numeric_limits<int64_t>::max();
  // The order of the stamps is not that of the sequences.
  map_.WriteObservations("a", {3, 0, 7, 1, 8, kLast, 2, 9}, 1);
  map_.WriteObservations("b", {5}, 3);
  map_.Write({.layer = "things", .retracted = {Key(3, "a", 7)}});
  const LogKey base{Key(7, "a", 2), 0};
  ASSERT_TRUE(map_.log().KeepCheckpoint("things", {base, "state", {}}, {}).ok());
  EXPECT_FALSE(*map_.log().HasForgotten("things", "a"));
  ASSERT_TRUE(map_.log().MoveBase("things", base).ok());
  const auto expect_known = [&] {
    EXPECT_TRUE(*map_.log().HasForgotten("things", "a"));
    EXPECT_TRUE(*map_.log().HasForgotten("things", "b"));
    EXPECT_FALSE(*map_.log().HasForgotten("things", "c"));
    EXPECT_FALSE(*map_.log().HasForgotten("others", "a"));
    EXPECT_THAT(*map_.log().Sequences("things", "a"),
                ElementsAre(SequenceRange{0, 3}, SequenceRange{7, 9}, SequenceRange{kLast, kLast}));
    EXPECT_THAT(*map_.log().Sequences("things", "b"), ElementsAre(SequenceRange{5, 5}));
    for (const int64_t sequence : {int64_t{0}, int64_t{3}, int64_t{7}, int64_t{9}, kLast}) {
      EXPECT_NE(*map_.log().FindObservation("things", "a", sequence), std::nullopt) << sequence;
    }
    for (const int64_t sequence : {int64_t{-1}, int64_t{4}, int64_t{6}, int64_t{10}, kLast - 1}) {
      EXPECT_EQ(*map_.log().FindObservation("things", "a", sequence), std::nullopt) << sequence;
    }
    EXPECT_THAT(map_.Bodies(base), ElementsAre("body"));
  };
  expect_known();
  // A few rows at a time: names are known at every moment.
  for (int step = 0; *map_.stored().Compact(0, absl::InfinitePast(), 3); ++step) {
    ASSERT_LT(step, 10);
    expect_known();
  }
  expect_known();
  EXPECT_THAT(map_.Bodies(BeforeAll()), ElementsAre("body"));
  EXPECT_EQ((**map_.log().FindObservation("things", "a", 8)).content_hash, std::nullopt);
  EXPECT_EQ((**map_.log().FindObservation("things", "a", 9)).content_hash, 0xfedcba9876543210);
}

TEST_P(FusionLogContract, BaseMovesToACheckpointOnly) {
  map_.Write({.layer = "things", .settings = FusionSettings{"evidence", "{}", ""}});
  EXPECT_FALSE(map_.log().MoveBase("things", {Key(1, "a", 1), 0}).ok());
  EXPECT_EQ(*map_.log().FindBase("things"), std::nullopt);
}

TEST_P(FusionLogContract, FailedCommitStoresNoEvidence) {
  if (GetParam().exceptions.content) GTEST_SKIP();
  FusionChange change{.layer = "things",
                      .settings = FusionSettings{"evidence", "{}", ""},
                      .observations = {Logged(Key(1, "a", 0), "0"), Logged(Key(2, "a", 0), "1")}};
  Commit commit = MakeCommit(map_.now(), {{PutObject{"others", UnitSquare("cup"), ""}}});
  commit.fusion.push_back(change);
  EXPECT_FALSE(map_.stored().Write({commit}).ok());
  EXPECT_TRUE(map_.log().FusedLayers()->empty());
  EXPECT_TRUE(map_.Bodies(BeforeAll()).empty());
}

TEST_P(FusionLogContract, CommitChangesTheLogsOfSeveralLayers) {
  Commit commit = MakeCommit(map_.now(), {{PutObject{"others", UnitSquare("cup"), ""}}});
  for (const char* layer : {"things", "others"}) {
    commit.fusion.push_back({.layer = layer,
                             .settings = FusionSettings{layer, "{}", ""},
                             .observations = {Logged(Key(1, "a", 1), layer)}});
  }
  ASSERT_TRUE(map_.stored().Write({commit}).ok());
  EXPECT_EQ(map_.log().FusedLayers()->size(), 2u);
  for (const char* layer : {"things", "others"}) {
    EXPECT_EQ(map_.log().Read(layer, BeforeAll(), 9)->front().body, layer);
  }
}

TEST_P(FusionLogContract, LayerThatIsMadeAnewInACommitBeginsANewLog) {
  map_.Write({.layer = "things",
              .settings = FusionSettings{"evidence", "{}", ""},
              .observations = {Logged(Key(1, "a", 1), "old")},
              .tracks = {{"t", 1}}});
  map_.Write({.layer = "things",
              .settings = FusionSettings{"evidence", "{}", ""},
              .observations = {Logged(Key(1, "a", 1), "new")}},
             {{DeleteLayer{"things"}, CreateLayer{SemanticSpec("things")}}});
  EXPECT_THAT(map_.Bodies(BeforeAll()), ElementsAre("new"));
  EXPECT_TRUE(map_.log().Tracks("things")->empty());
}

TEST_P(FusionLogContract, LayerThatIsNotFusedHasNoEvidence) {
  EXPECT_TRUE(map_.log().FusedLayers()->empty());
  EXPECT_TRUE(map_.log().Tracks("things")->empty());
  EXPECT_EQ(*map_.log().FindObservation("things", "a", 1), std::nullopt);
  EXPECT_TRUE(map_.log().Sequences("things", "a")->empty());
  EXPECT_EQ(*map_.log().NewestKey("things"), std::nullopt);
  EXPECT_EQ(*map_.log().NewestFact("things"), std::nullopt);
  EXPECT_TRUE(map_.log().Read("things", BeforeAll(), 9)->empty());
  EXPECT_EQ(*map_.log().FindCheckpoint("things", std::nullopt), std::nullopt);
  EXPECT_TRUE(map_.log().Checkpoints("things")->empty());
  EXPECT_EQ(*map_.log().FindBase("things"), std::nullopt);
  EXPECT_EQ(*map_.log().FindNextBase("things", absl::InfiniteFuture()), std::nullopt);
  EXPECT_FALSE(*map_.log().HasForgotten("things", "a"));
  EXPECT_FALSE(map_.stored().Compact(0, absl::InfinitePast(), 100).value_or(true));
}

}  // namespace
}  // namespace hypermap::storage
