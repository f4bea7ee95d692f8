// Late observations that are folded in advance give what they give otherwise, whatever happens
// meanwhile.
#include "server/fusion/late_fold.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/fusion/map_fusion.h"
#include "server/fusion/testing/fused_map.h"
#include "server/fusion/testing/tally_strategy.h"
#include "tests/support/random_map.h"

namespace hypermap::server {
namespace {

using ::hypermap::testing::UniformInt;
using Lane = FusedLayer::Lane;

// An observation of one or two of six things.
Observation See(int64_t sequence, double at_s, hypermap::testing::Rng& rng) {
  Observation observation;
  observation.robot = std::string("robot ") + static_cast<char>('a' + UniformInt(rng, 0, 2));
  observation.sequence = sequence;
  observation.stamp = absl::FromUnixSeconds(1'700'000'000) + absl::Seconds(at_s);
  for (int i = UniformInt(rng, 1, 2); i > 0; --i) {
    Detection detection;
    const int thing = UniformInt(rng, 0, 5);
    detection.scores = {{absl::StrCat("thing ", thing), 0.9}};
    const double x = 2.0 * thing + 0.001 * static_cast<double>(sequence);
    detection.hull = Polygon::FromBox({{x, 0}, {x + 1, 1}});
    detection.num_points = 5;
    observation.detections.push_back(detection);
  }
  return observation;
}

// A step of the life of a layer, which is carried out with and without folding in advance.
using Step = std::function<void(FusedMap&)>;

class LateFoldTest : public ::testing::TestWithParam<const char*> {
 protected:
  // Folds the observations in advance until a random entry.
  void FoldSome(Lane lane, bool begin, const std::vector<Observation>& late) {
    std::vector<FusedLayer::LateObservation> observations;
    for (const Observation& observation : late) {
      observations.push_back({&observation, observation.stamp});
    }
    int entries = UniformInt(rng_, 1, 80);
    const auto left = map_.fusion().FoldLate(map_.snapshot(), "things", lane, begin, observations,
                                             [&entries] { return --entries <= 0; });
    ASSERT_TRUE(left.ok()) << left.status();
  }

  void Both(const Step& step) {
    step(map_);
    step(oracle_);
    ASSERT_EQ(map_.Objects(), oracle_.Objects());
  }

  // Something that changes the log.
  void ChangeSomething() {
    switch (UniformInt(rng_, 0, 7)) {
      case 0: {
        const std::vector<SemanticObject> objects = oracle_.Objects();
        if (objects.empty()) return;
        const SemanticObject& object = objects[UniformInt(rng_, 0, objects.size() - 1)];
        const bool removes = UniformInt(rng_, 0, 3) == 0;
        return Both([&](FusedMap& map) {
          const hypermap::Edit edit = removes ? hypermap::Edit(DeleteObject{"things", object.id})
                                              : hypermap::Edit(PutObject{"things", object, ""});
          ASSERT_TRUE(map.Edit({{edit}}).ok());
        });
      }
      case 1: {
        const absl::Time from =
            absl::FromUnixSeconds(1'700'000'000 + UniformInt(rng_, 0, static_cast<int>(now_s_)));
        return Both([&](FusedMap& map) {
          map.Run(RetractObservations{"things", "robot a", from, from + absl::Seconds(2)})
              .status()
              .IgnoreError();
        });
      }
      case 2: {
        PoseCorrection correction{"robot a", {}};
        const int from_s = UniformInt(rng_, 0, static_cast<int>(now_s_));
        for (int i = 0; i < 5; ++i) {
          correction.poses.push_back(
              {absl::FromUnixSeconds(1'700'000'000 + from_s) + i * kMaxPoseGap,
               PlanarTransform(0.01 * UniformInt(rng_, -20, 20), 0.0,
                               0.01 * UniformInt(rng_, -5, 5)),
               0.001 * Eigen::Matrix3d::Identity()});
        }
        return Both([&](FusedMap& map) {
          map.Run(CorrectPoses{"things", "", {correction}}).status().IgnoreError();
        });
      }
      case 3:
        if (UniformInt(rng_, 0, 9) > 0) return;
        return Both([](FusedMap& map) {
          ASSERT_TRUE(map.Run(RebuildFusion{"things", "", ""}).ok());
        });
      default: {
        // On time, or a little late.
        now_s_ += 0.1 * UniformInt(rng_, 1, 10);
        const double late_s = UniformInt(rng_, 0, 2) == 0 ? 0.1 * UniformInt(rng_, 1, 30) : 0.0;
        const Observation observation = See(++sequence_, now_s_ - late_s, rng_);
        return Both([&](FusedMap& map) { ASSERT_TRUE(map.Observe(observation).ok()); });
      }
    }
  }

  hypermap::testing::Rng rng_{hypermap::testing::TestSeed()};
  FusedMap map_{[](absl::string_view, absl::string_view) {
    return fusion::MakeStrategy(LateFoldTest::GetParam(), "");
  }};
  FusedMap oracle_{[](absl::string_view, absl::string_view) {
    return fusion::MakeStrategy(LateFoldTest::GetParam(), "");
  }};
  int64_t sequence_ = 0;
  double now_s_ = 0.0;
};

TEST_P(LateFoldTest, GivesWhatTheObservationsGiveOtherwise) {
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << hypermap::testing::TestSeed());
  map_.options().entries_per_checkpoint = 4;
  for (int i = 0; i < 100; ++i) ChangeSomething();
  for (int round = 0; round < 12; ++round) {
    std::vector<std::vector<Observation>> late(FusedLayer::kNumLanes);
    for (auto& observations : late) {
      for (int i = UniformInt(rng_, 1, 4); i > 0; --i) {
        observations.push_back(See(++sequence_, UniformInt(rng_, 0, 100) / 100.0 * now_s_, rng_));
      }
    }
    bool begin[] = {true, true};
    for (int step = UniformInt(rng_, 1, 6); step > 0; --step) {
      const int lane = UniformInt(rng_, 0, 1);
      FoldSome(static_cast<Lane>(lane), std::exchange(begin[lane], false), late[lane]);
      for (int i = UniformInt(rng_, 0, 3); i > 0; --i) ChangeSomething();
    }
    // The log may get others than those that were announced.
    if (UniformInt(rng_, 0, 4) == 0) late[0].pop_back();
    if (UniformInt(rng_, 0, 4) == 0) late[1].front().detections.clear();
    if (UniformInt(rng_, 0, 4) == 0) late[0].insert(late[0].end(), late[1].begin(), late[1].end());
    for (const auto& observations : late) {
      if (observations.empty()) continue;
      Both([&](FusedMap& map) { ASSERT_TRUE(map.Observe(observations).ok()); });
    }
    if (HasFatalFailure()) return;
  }
  // The layer shows the fold of the log.
  const auto rebuilt = map_.Run(RebuildFusion{"things", "", ""});
  ASSERT_TRUE(rebuilt.ok()) << rebuilt.status();
  EXPECT_TRUE(rebuilt->empty());
}

// Counts the observations that are folded.
class CountingTally : public TallyStrategy {
 public:
  explicit CountingTally(int* num_folds) : TallyStrategy("tally"), num_folds_(num_folds) {}

  fusion::StatePtr Fold(const fusion::StatePtr& state, const Observation& observation,
                        fusion::FoldReport* report) const override {
    ++*num_folds_;
    return TallyStrategy::Fold(state, observation, report);
  }

 private:
  int* const num_folds_;
};

TEST(LateFoldCostTest, LittleIsLeftForTheCommit) {
  int num_folds = 0;
  FusedMap map([&num_folds](absl::string_view, absl::string_view) {
    return std::make_unique<CountingTally>(&num_folds);
  });
  hypermap::testing::Rng rng(1);
  constexpr int kEntries = 1000;
  std::vector<Observation> log;
  for (int i = 0; i < kEntries; ++i) log.push_back(See(i, 0.1 * i, rng));
  ASSERT_TRUE(map.Observe(log).ok());
  const Observation late = See(kEntries, 20.05, rng);
  const auto fold_some = [&](bool begin, int entries) {
    const FusedLayer::LateObservation observations[] = {{&late, late.stamp}};
    const auto left = map.fusion().FoldLate(map.snapshot(), "things", Lane::kFar, begin,
                                            observations, [&entries] { return --entries <= 0; });
    EXPECT_TRUE(left.ok()) << left.status();
    return left.value_or(0);
  };
  num_folds = 0;
  EXPECT_GT(fold_some(true, 100), 600);
  EXPECT_EQ(num_folds, 100);
  // An observation on time, and one that is a little late, make nothing of it worthless.
  ASSERT_TRUE(map.Observe(See(kEntries + 1, 100, rng)).ok());
  ASSERT_TRUE(map.Observe(See(kEntries + 2, 99.05, rng)).ok());
  num_folds = 0;
  EXPECT_EQ(fold_some(false, 10'000), 0);
  EXPECT_LT(num_folds, 800);
  num_folds = 0;
  ASSERT_TRUE(map.Observe(late).ok());
  EXPECT_EQ(num_folds, 0);
  // Without work in advance, all is folded by the commit.
  ASSERT_TRUE(map.Observe(See(kEntries + 3, 20.06, rng)).ok());
  EXPECT_GT(num_folds, 700);
}

INSTANTIATE_TEST_SUITE_P(Strategies, LateFoldTest, ::testing::Values("evidence", "paper"));

}  // namespace
}  // namespace hypermap::server
