#include "server/fusion/evidence_log.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/fusion/testing/fused_map.h"
#include "server/fusion/testing/memory_fusion_log.h"
#include "tests/support/random_map.h"
#include "wire/observation.h"

namespace hypermap::server {
namespace {

absl::Time At(int64_t seconds) { return absl::FromUnixSeconds(seconds); }

// Counts the searches for the newest stamp of a robot.
class CountingLog : public MemoryFusionLog {
 public:
  absl::StatusOr<std::optional<absl::Time>> NewestStamp(const std::string& layer,
                                                        const std::string& robot) override {
    ++num_searches;
    return MemoryFusionLog::NewestStamp(layer, robot);
  }
  absl::StatusOr<std::vector<ObservationKey>> KeysOf(const std::string& layer,
                                                     const std::string& robot, absl::Time from,
                                                     absl::Time to) override {
    ++num_searches;
    return MemoryFusionLog::KeysOf(layer, robot, from, to);
  }

  int num_searches = 0;
};

class EvidenceLogTest : public ::testing::Test {
 protected:
  EvidenceLogTest() : codec_(TestCodec()), log_(*EvidenceLog::Open("things", &stored_, &codec_)) {}

  void Add(const std::string& robot, int64_t sequence, absl::Time stamp) {
    auto observation = std::make_shared<Observation>();
    observation->robot = robot;
    observation->sequence = sequence;
    observation->stamp = stamp;
    log_.Add(observation, {KeyOf(*observation), 0, stamp, wire::ObservationToBytes(*observation)});
  }
  void Store() {
    storage::FusionChange change{.layer = "things"};
    log_.TakeChange(&change);
    stored_.Apply(change);
    log_.Written();
  }
  std::optional<absl::Time> Newest(const std::string& robot) {
    const auto newest = log_.NewestStamp(robot);
    EXPECT_TRUE(newest.ok()) << newest.status();
    return newest.value_or(std::nullopt);
  }

  EvidenceCodec codec_;
  CountingLog stored_;
  EvidenceLog log_;
};

TEST_F(EvidenceLogTest, NewestStampIsThatOfTheLogWhateverIsStored) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng rng(seed);
  using hypermap::testing::UniformInt;
  const std::string robots[] = {"a", "b", "c"};
  std::map<std::string, std::multimap<absl::Time, int64_t>> all;  // by robot: stamps, sequences
  int64_t sequence = 0;
  for (int step = 0; step < 1000; ++step) {
    const std::string& robot = robots[UniformInt(rng, 0, 2)];
    auto& own = all[robot];
    const int kind = UniformInt(rng, 0, 9);
    if (kind < 4) {
      const absl::Time stamp = At(UniformInt(rng, 0, 50));
      Add(robot, ++sequence, stamp);
      own.emplace(stamp, sequence);
    } else if (kind < 6) {
      const absl::Time from = At(UniformInt(rng, -5, 50));
      const absl::Time to = from + absl::Seconds(UniformInt(rng, 0, 60));
      const auto retracted = log_.Retract(robot, from, to);
      ASSERT_TRUE(retracted.ok()) << retracted.status();
      own.erase(own.lower_bound(from), own.lower_bound(to));
    } else if (kind < 7) {
      Store();
    } else {
      std::optional<absl::Time> newest;
      if (!own.empty()) newest = own.rbegin()->first;
      ASSERT_EQ(Newest(robot), newest) << "step " << step << ", robot " << robot;
      ASSERT_EQ(Newest("never"), std::nullopt);
    }
  }
}

TEST_F(EvidenceLogTest, StoreIsSearchedOnceForARobotThatStaysAsItIs) {
  Add("cart", 0, At(5));
  Add("lift", 0, At(6));
  Store();
  ASSERT_TRUE(log_.Retract("lift", absl::InfinitePast(), absl::InfiniteFuture()).ok());
  // While the retraction is not stored yet, and after that.
  for (const bool is_stored : {false, true}) {
    SCOPED_TRACE(is_stored);
    if (is_stored) Store();
    for (int i = 0; i < 100; ++i) {
      EXPECT_EQ(Newest("cart"), At(5));
      EXPECT_EQ(Newest("lift"), std::nullopt);
      EXPECT_EQ(Newest("never"), std::nullopt);
    }
    // One for each robot, and one of Retract.
    EXPECT_EQ(stored_.num_searches, 4);
  }
}

TEST_F(EvidenceLogTest, NamesThatNobodyHasDoNotChangeAnswers) {
  Add("cart", 0, At(5));
  Store();
  Add("lift", 0, At(6));
  for (int i = 0; i < 3000; ++i) EXPECT_EQ(Newest(absl::StrCat("robot ", i)), std::nullopt);
  EXPECT_EQ(Newest("cart"), At(5));
  EXPECT_EQ(Newest("lift"), At(6));
}

}  // namespace
}  // namespace hypermap::server
