// The content of logs of evidence comes back as it was written, at the limits of its types.
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/contract.h"
#include "storage/conformance/testing/evidence_map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::Rng;
using ::testing::ElementsAre;

class EvidenceContentContract : public StoreContract {
 protected:
  EvidenceContentContract() : map_(CreateMap(*store_, "site")) {}

  EvidenceMap map_;
};

HYPERMAP_CONFORMANCE_SUITE(EvidenceContentContract);

TEST_P(EvidenceContentContract, LimitsOfSequencesStampsAndHashesComeBack) {
  constexpr int64_t kLeast = std::numeric_limits<int64_t>::min();
  constexpr int64_t kMost = std::numeric_limits<int64_t>::max();
  FusionChange change{.layer = "things", .settings = FusionSettings{"evidence", "{}", ""}};
  const std::vector<ObservationKey> keys = {
      Key(kLeast, "a", kLeast), Key(-1, "a", kMost),    Key(0, "a", kLeast + 1), Key(1, "a", -1),
      Key(1, "a", 0),           Key(2, "a", kMost - 1), Key(kMost - 1, "a", 5)};
  const std::vector<uint64_t> hashes = {
      0, 1, std::numeric_limits<uint64_t>::max(), uint64_t{1} << 63, 2, 3, 4};
  for (size_t i = 0; i < keys.size(); ++i) {
    change.observations.push_back({keys[i], hashes[i], absl::FromUnixNanos(kLeast), "body"});
  }
  map_.Write(change);
  const std::vector<SequenceRange> sequences = {
      {kLeast, kLeast + 1}, {-1, 0}, {5, 5}, {kMost - 1, kMost}};
  EXPECT_EQ(*map_.log().Sequences("things", "a"), sequences);
  EXPECT_EQ(*map_.log().KeysOf("things", "a", absl::InfinitePast(), absl::InfiniteFuture()), keys);
  for (size_t i = 0; i < keys.size(); ++i) {
    EXPECT_EQ((**map_.log().FindObservation("things", "a", keys[i].sequence)).content_hash,
              hashes[i]);
  }
  EXPECT_EQ(*map_.log().NewestStamp("things", "a"), keys.back().stamp);
  EXPECT_EQ(map_.log().Read("things", BeforeAll(), 99)->size(), keys.size());
  const LogKey base{keys.back(), 0};
  ASSERT_TRUE(map_.log().KeepCheckpoint("things", {base, "", {}}, {}).ok());
  ASSERT_TRUE(map_.log().MoveBase("things", base).ok());
  map_.Compact();
  EXPECT_EQ(*map_.log().Sequences("things", "a"), sequences);
  for (const ObservationKey& key : keys) {
    EXPECT_NE(*map_.log().FindObservation("things", "a", key.sequence), std::nullopt);
  }
  EXPECT_EQ(*map_.log().FindObservation("things", "a", kLeast + 2), std::nullopt);
  EXPECT_EQ(*map_.log().FindObservation("things", "a", kMost - 2), std::nullopt);
}

TEST_P(EvidenceContentContract, RobotsAreOrderedAndComparedByTheirBytes) {
  // In the order of the bytes.
  const std::vector<std::string> robots = {"",       " ",      "%",      "A",         "Z",    "_",
                                           "a",      "a ",     "a%",     "e\u0301",   "it's", "r\\",
                                           "\u00e4", "\u00e9", "\uffee", "\U0001f916"};
  FusionChange change{.layer = "things", .settings = FusionSettings{"evidence", "{}", ""}};
  for (auto robot = robots.rbegin(); robot != robots.rend(); ++robot) {
    change.observations.push_back(Logged(Key(7, *robot, 1), *robot));
  }
  map_.Write(change);
  EXPECT_EQ(map_.Bodies(BeforeAll()), robots);
  EXPECT_EQ(*map_.log().NewestKey("things"), Key(7, robots.back(), 1));
  for (size_t i = 0; i < robots.size(); ++i) {
    SCOPED_TRACE(robots[i]);
    const LogKey key{Key(7, robots[i], 1), 0};
    EXPECT_EQ(map_.Bodies(key),
              std::vector<std::string>(robots.begin() + static_cast<int64_t>(i) + 1, robots.end()));
    EXPECT_THAT(*map_.log().Sequences("things", robots[i]), ElementsAre(SequenceRange{1, 1}));
    EXPECT_THAT(
        *map_.log().KeysOf("things", robots[i], absl::InfinitePast(), absl::InfiniteFuture()),
        ElementsAre(key.after));
  }
  EXPECT_TRUE(map_.log().Sequences("things", "z")->empty());
}

TEST_P(EvidenceContentContract, SettingsTracksAndFactsComeBackToTheByte) {
  const std::string text = "it's \"100%_\" \\ \u00e9 \U0001f916\n{\"a\": [1]}";
  std::string bytes;
  for (int byte = 0; byte < 256; ++byte) bytes.push_back(static_cast<char>(byte));
  const LogKey fact{BeforeAll().after, 1};
  map_.Write({.layer = "things",
              .settings = FusionSettings{"evidence", text, "explored"},
              .facts = {{fact, "pin", text, bytes}, {{fact.after, 2}, "remove", "", ""}},
              .tracks = {{text, 7}, {"t", std::numeric_limits<ObjectId>::max()}}});
  EXPECT_THAT(*map_.log().FusedLayers(),
              ElementsAre(std::pair("things", FusionSettings{"evidence", text, "explored"})));
  EXPECT_THAT(*map_.log().Tracks("things"),
              ::testing::UnorderedElementsAre(TrackId(text, 7),
                                              TrackId("t", std::numeric_limits<ObjectId>::max())));
  const auto entries = map_.log().Read("things", BeforeAll(), 9);
  ASSERT_TRUE(entries.ok()) << entries.status();
  ASSERT_EQ(entries->size(), 2u);
  EXPECT_EQ(entries->front().key, fact);
  EXPECT_EQ(entries->front().kind, "pin");
  EXPECT_EQ(entries->front().track, text);
  EXPECT_EQ(entries->front().body, bytes);
  EXPECT_EQ(entries->back().kind, "remove");
  EXPECT_EQ(entries->back().body, "");
  // Later ones take the place of the first.
  map_.Write(
      {.layer = "things", .settings = FusionSettings{"paper", "", ""}, .tracks = {{"t", 0}}});
  EXPECT_THAT(*map_.log().FusedLayers(),
              ElementsAre(std::pair("things", FusionSettings{"paper", "", ""})));
  EXPECT_THAT(*map_.log().Tracks("things"),
              ::testing::UnorderedElementsAre(TrackId(text, 7), TrackId("t", 0)));
}

TEST_P(EvidenceContentContract, EmptyAndLargeBodiesComeBack) {
  Rng rng(seed_);
  std::string random(3 << 20, '\0');
  for (char& byte : random) byte = static_cast<char>(rng());
  const std::string uniform(20 << 20, 'x');
  map_.Write({.layer = "things",
              .settings = FusionSettings{"evidence", "{}", ""},
              .observations = {Logged(Key(1, "a", 1), ""), Logged(Key(2, "a", 2), random),
                               Logged(Key(3, "a", 3), uniform)},
              .facts = {{{Key(3, "a", 3), 1}, "pin", "t", random}}});
  const LogKey key{Key(3, "a", 3), 1};
  ASSERT_TRUE(map_.log().KeepCheckpoint("things", {key, random, {}}, {}).ok());
  const std::vector<std::string> bodies = map_.Bodies(BeforeAll());
  ASSERT_EQ(bodies.size(), 4u);
  EXPECT_EQ(bodies[0], "");
  EXPECT_TRUE(bodies[1] == random);
  EXPECT_TRUE(bodies[2] == uniform);
  EXPECT_TRUE(bodies[3] == random);
  EXPECT_TRUE((**map_.log().FindCheckpoint("things", std::nullopt)).state == random);
  ASSERT_TRUE(map_.log().MoveBase("things", key).ok());
  EXPECT_TRUE((**map_.log().FindBase("things")).state == random);
}

}  // namespace
}  // namespace hypermap::storage
