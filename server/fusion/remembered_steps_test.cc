// Steps of folds are remembered, and layers whose observations come in any order show the fold of
// their logs with them.
#include "server/fusion/remembered_steps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "map/fusion/testing/scene.h"
#include "map/observations/view_frame.h"
#include "server/fusion/testing/fused_map.h"
#include "tests/support/random_map.h"

namespace hypermap::server {
namespace {

using ::hypermap::testing::Uniform;
using ::hypermap::testing::UniformInt;

class StepOf100Bytes : public fusion::FoldStep {
 public:
  int64_t bytes() const override { return 100; }
};

storage::LogKey Key(int64_t sequence) {
  return {{absl::FromUnixSeconds(sequence), "robot", sequence}, 0};
}

TEST(RememberedStepsTest, KeepsTheNewestWithinItsBytes) {
  RememberedSteps steps(250);
  const auto observation = std::make_shared<const Observation>();
  const auto step = std::make_shared<const StepOf100Bytes>();
  for (const int i : {5, 3, 4, 1}) steps.Set(Key(i), observation, step);
  EXPECT_EQ(steps.Find(Key(1), *observation), nullptr);
  EXPECT_EQ(steps.Find(Key(3), *observation), nullptr);
  EXPECT_EQ(steps.Find(Key(4), *observation), step);
  EXPECT_EQ(steps.Find(Key(5), *observation), step);
  EXPECT_EQ(steps.bytes(), 200);
  EXPECT_EQ(steps.NumAfter(Key(4)), 1u);
  // Another observation of the same name, as a correction makes it.
  EXPECT_EQ(steps.Find(Key(4), Observation()), nullptr);
  steps.Set(Key(4), observation, nullptr);
  EXPECT_EQ(steps.Find(Key(4), *observation), nullptr);
  EXPECT_EQ(steps.bytes(), 100);
}

TEST(RememberedStepsTest, StepsThatAreNotRepeatedCountAsFolds) {
  RememberedSteps steps(1000);
  EXPECT_LT(steps.FoldsFor(160), 20.0);
  for (int i = 0; i < 500; ++i) steps.Count(false);
  EXPECT_GT(steps.FoldsFor(160), 150.0);
  for (int i = 0; i < 500; ++i) steps.Count(true);
  EXPECT_LT(steps.FoldsFor(160), 20.0);
}

// Another strategy without what makes folding and showing cheaper.
class Plain : public fusion::Strategy {
 public:
  explicit Plain(std::unique_ptr<fusion::Strategy> inner) : inner_(std::move(inner)) {}

  absl::string_view name() const override { return inner_->name(); }
  fusion::StatePtr Initial() const override { return inner_->Initial(); }
  fusion::StatePtr Fold(const fusion::StatePtr& state, const Observation& observation,
                        fusion::FoldReport* report) const override {
    return inner_->Fold(state, observation, report);
  }
  std::unique_ptr<fusion::FactFold> FoldFacts(const fusion::StatePtr& state) const override {
    return inner_->FoldFacts(state);
  }
  std::vector<fusion::FusedObject> Objects(const fusion::StatePtr& state) const override {
    return inner_->Objects(state);
  }
  int64_t ByteSize(const fusion::StatePtr& state, const fusion::StatePtr& older) const override {
    return inner_->ByteSize(state, older);
  }
  int64_t MostGrowth(const Observation& observation) const override {
    return inner_->MostGrowth(observation);
  }
  std::string Encode(const fusion::StatePtr& state) const override { return inner_->Encode(state); }
  absl::StatusOr<fusion::StatePtr> Decode(absl::string_view bytes) const override {
    return inner_->Decode(bytes);
  }

 private:
  const std::unique_ptr<fusion::Strategy> inner_;
};

absl::StatusOr<std::unique_ptr<fusion::Strategy>> MakePlain(absl::string_view name,
                                                            absl::string_view parameters) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<fusion::Strategy> inner,
                            fusion::MakeStrategy(name, parameters));
  return std::make_unique<Plain>(std::move(inner));
}

constexpr int kPlaces = 3;

std::vector<fusion::SceneBox> Boxes() {
  std::vector<fusion::SceneBox> boxes;
  for (int place = 0; place < kPlaces; ++place) {
    for (int i = 0; i < 3; ++i) {
      const double x = 9.0 * place + 2.0 + 0.3 * i;
      const double y = 0.6 * i - 0.8;
      boxes.push_back({i == 0 ? "chair" : "box", Box{{x, y}, {x + 0.4, y + 0.4}}, {0.0, 0.5}});
    }
  }
  return boxes;
}

// The observation as a robot sends it that tells what it sees relative to its camera.
Observation RelativeToItsView(const Observation& observation) {
  const PlanarTransform view = ViewPose(observation.pose.frame_from_camera);
  Observation relative = Transformed(observation, view.Inverse(), observation.frame_id);
  relative.pose.covariance = observation.pose.covariance;
  relative.frame_from_view = view;
  return relative;
}

class OutOfOrderTest : public ::testing::Test {
 protected:
  OutOfOrderTest() {
    for (FusedMap* map : {&map_, &oracle_}) {
      map->options().entries_per_checkpoint = 4;
      map->options().entries_per_stored_checkpoint = 16;
    }
  }

  Observation Look(int64_t number) {
    fusion::SceneDetector detector{.score = Uniform(rng_, 0.3, 1.0),
                                   .pose_error_x = Uniform(rng_, -0.05, 0.05)};
    std::vector<fusion::SceneBox> boxes = Boxes();
    if (UniformInt(rng_, 0, 3) == 0) {
      boxes.erase(boxes.begin() + UniformInt(rng_, 0, static_cast<int>(boxes.size()) - 1));
    }
    const int robot = UniformInt(rng_, 0, 2);
    const Observation observation = fusion::Observe(
        boxes, {.x = 9.0 * UniformInt(rng_, 0, kPlaces - 1), .y = Uniform(rng_, -0.2, 0.2)}, number,
        detector, absl::StrCat("robot ", robot));
    return robot == 0 ? observation : RelativeToItsView(observation);
  }

  void Both(const std::function<void(FusedMap&)>& step) {
    step(map_);
    step(oracle_);
    ASSERT_EQ(map_.Objects(), oracle_.Objects());
  }

  // Something else than an observation.
  void ChangeSomething(absl::Time now) {
    const absl::Time from = now - absl::Milliseconds(UniformInt(rng_, 0, 4000));
    switch (UniformInt(rng_, 0, 4)) {
      case 0:
      case 1: {
        const std::vector<SemanticObject> objects = oracle_.Objects();
        if (objects.empty()) return;
        SemanticObject object = objects[UniformInt(rng_, 0, static_cast<int>(objects.size()) - 1)];
        const bool removes = UniformInt(rng_, 0, 2) == 0;
        if (UniformInt(rng_, 0, 2) == 0) object.id = 0;
        return Both([&](FusedMap& map) {
          const hypermap::Edit edit = removes && object.id != 0
                                          ? hypermap::Edit(DeleteObject{"things", object.id})
                                          : hypermap::Edit(PutObject{"things", object, ""});
          ASSERT_TRUE(map.Edit({{edit}}).ok());
        });
      }
      case 2:
        return Both([&](FusedMap& map) {
          map.Run(RetractObservations{"things", "robot 0", from, from + absl::Seconds(1)})
              .status()
              .IgnoreError();
        });
      case 3: {
        PoseCorrection correction{"robot 1", {}};
        for (int i = 0; i < 4; ++i) {
          correction.poses.push_back({from + i * kMaxPoseGap,
                                      PlanarTransform(Uniform(rng_, 0.0, 9.0), 0.0, 0.0),
                                      0.001 * Eigen::Matrix3d::Identity()});
        }
        return Both([&](FusedMap& map) {
          map.Run(CorrectPoses{"things", "", {correction}}).status().IgnoreError();
        });
      }
      default:
        repeated_ += map_.fusion().work().repeated;
        map_.Restart();
    }
  }

  hypermap::testing::Rng rng_{hypermap::testing::TestSeed()};
  FusedMap map_;
  FusedMap oracle_{&MakePlain};
  int64_t repeated_ = 0;
};

TEST_F(OutOfOrderTest, TheLayerShowsTheFoldInOrder) {
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << hypermap::testing::TestSeed());
  // Late by up to 20 entries.
  std::vector<std::pair<int, Observation>> arrivals;
  for (int i = 0; i < 150; ++i) arrivals.emplace_back(i + UniformInt(rng_, 0, 20), Look(i));
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  absl::Time now;
  for (size_t next = 0; next < arrivals.size();) {
    std::vector<Observation> group;
    for (int i = UniformInt(rng_, 1, 4); i > 0 && next < arrivals.size(); --i) {
      group.push_back(arrivals[next++].second);
      now = std::max(now, group.back().stamp);
    }
    ASSERT_NO_FATAL_FAILURE(Both([&](FusedMap& map) { ASSERT_TRUE(map.Observe(group).ok()); }));
    if (UniformInt(rng_, 0, 4) == 0) ASSERT_NO_FATAL_FAILURE(ChangeSomething(now));
  }
  repeated_ += map_.fusion().work().repeated;
  EXPECT_GT(repeated_, 100);
  EXPECT_EQ(oracle_.fusion().work().repeated, 0);
  EXPECT_FALSE(map_.Objects().empty());
  const auto rebuilt = map_.Run(RebuildFusion{"things", "", ""});
  ASSERT_TRUE(rebuilt.ok()) << rebuilt.status();
  EXPECT_TRUE(rebuilt->empty());
}

TEST_F(OutOfOrderTest, EntriesWhoseFoldsCanBeRepeatedCountLess) {
  std::vector<Observation> looks;
  for (int i = 0; i < 100; ++i) {
    if (i != 20) looks.push_back(Look(i));
  }
  const std::vector<Observation> late = {Look(20)};
  const auto entries = [&](FusedMap& map) {
    EXPECT_TRUE(map.Observe(looks).ok());
    return map.fusion().EntriesToFold(map.snapshot(), "things", late).value_or(-1);
  };
  EXPECT_GE(entries(oracle_), 79);
  const int64_t counted = entries(map_);
  EXPECT_GE(counted, 1);
  EXPECT_LT(counted, 20);
}

}  // namespace
}  // namespace hypermap::server
