// Old evidence can be forgotten: what layers show goes on as if all of it were there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "server/fusion/map_fusion.h"
#include "server/fusion/testing/fused_map.h"
#include "server/fusion/testing/tally_strategy.h"
#include "tests/support/random_map.h"

namespace hypermap::server {
namespace {

using ::hypermap::testing::UniformInt;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr absl::Duration kLateness = absl::Seconds(20);
constexpr absl::Duration kAge = absl::Seconds(60);

absl::Time AtSecond(double seconds) {
  return absl::FromUnixSeconds(1'700'000'000) + absl::Seconds(seconds);
}

// An observation of one or two of six things.
Observation See(const std::string& robot, int64_t sequence, absl::Time at,
                hypermap::testing::Rng& rng) {
  Observation observation;
  observation.robot = robot;
  observation.sequence = sequence;
  observation.stamp = at;
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

class EvidenceRetentionTest : public ::testing::TestWithParam<const char*> {
 protected:
  EvidenceRetentionTest() {
    for (FusedMap* map : {&map_, &oracle_}) {
      FusionOptions& options = map->options();
      options.commit_clock = [this] { return now_; };
      options.max_lateness = kLateness;
      options.entries_per_checkpoint = 4;
      options.entries_per_stored_checkpoint = 6;
    }
    map_.options().observation_age = kAge;
    oracle_.options().observation_age = absl::InfiniteDuration();
  }

  // A second passes, and the robot sees something. Only map_ forgets.
  void Observe(const std::string& robot) {
    now_ += absl::Seconds(1);
    const Observation observation = See(robot, ++sequence_, now_, rng_);
    for (FusedMap* map : {&map_, &oracle_}) ASSERT_TRUE(map->Observe(observation).ok());
  }

  // Returns whether map_ has forgotten anything.
  bool Forget() {
    const auto moved = map_.fusion().ForgetEvidence(now_ - kAge);
    EXPECT_TRUE(moved.ok()) << moved.status();
    return moved.ok() && !moved->empty();
  }

  // Lets the robot see things until something is forgotten.
  void ObserveUntilSomethingIsForgotten(const std::string& robot) {
    do {
      ASSERT_NO_FATAL_FAILURE(Observe(robot));
      ASSERT_LT(sequence_, 1000);
    } while (!Forget());
  }

  absl::Time BeginOfLog() {
    const auto fused = map_.fusion().Find(map_.snapshot(), "things");
    EXPECT_TRUE(fused.ok()) << fused.status();
    return (*fused)->log().begin().after.stamp;
  }

  hypermap::testing::Rng rng_{hypermap::testing::TestSeed()};
  absl::Time now_ = AtSecond(0);
  FusedMap map_{Always(GetParam())};
  FusedMap oracle_{Always(GetParam())};
  int64_t sequence_ = 0;
};

TEST_P(EvidenceRetentionTest, NothingThatIsShownChanges) {
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << hypermap::testing::TestSeed());
  int times_forgotten = 0;
  for (int step = 0; step < 600 || times_forgotten < 4; ++step) {
    ASSERT_LT(step, 20'000);
    now_ += absl::Milliseconds(100 * UniformInt(rng_, 0, 20));
    // Retractions, corrections and rebuilds are rare, because they drop the checkpoints that could
    // be bases.
    switch (UniformInt(rng_, 0, 100)) {
      case 0:
        map_.Restart();
        break;
      case 1:
      case 2:
      case 3:
      case 4:
        times_forgotten += Forget() ? 1 : 0;
        break;
      case 5:
      case 6:
      case 7: {
        const std::vector<SemanticObject> objects = oracle_.Objects();
        if (objects.empty()) break;
        const SemanticObject& object = objects[UniformInt(rng_, 0, objects.size() - 1)];
        const hypermap::Edit edit = UniformInt(rng_, 0, 1) == 0
                                        ? hypermap::Edit(DeleteObject{"things", object.id})
                                        : hypermap::Edit(PutObject{"things", object, ""});
        for (FusedMap* map : {&map_, &oracle_}) ASSERT_TRUE(map->Edit({{edit}}).ok());
        break;
      }
      case 8: {
        // Also of times whose evidence is forgotten, which map_ refuses.
        const absl::Time from = now_ - absl::Seconds(UniformInt(rng_, 0, 100));
        const RetractObservations retract{"things", "robot 1", from, from + absl::Seconds(3)};
        const auto edits = map_.Run(retract);
        if (edits.ok()) ASSERT_TRUE(oracle_.Run(retract).ok());
        EXPECT_TRUE(edits.ok() || absl::IsNotFound(edits.status()) ||
                    (absl::IsFailedPrecondition(edits.status()) && from <= BeginOfLog()))
            << edits.status();
        break;
      }
      case 9: {
        const absl::Time from = now_ - absl::Seconds(UniformInt(rng_, 0, 100));
        PoseCorrection correction{"robot 1", {}};
        for (int i = 0; i < 6; ++i) {
          const double x = 0.05 * UniformInt(rng_, -4, 4);
          correction.poses.push_back({from + i * kMaxPoseGap, PlanarTransform(x, 0.0, 0.02 * i),
                                      1e-4 * Eigen::Matrix3d::Identity()});
        }
        const CorrectPoses correct{"things", "", {correction}};
        const auto edits = map_.Run(correct);
        if (edits.ok()) ASSERT_TRUE(oracle_.Run(correct).ok());
        EXPECT_TRUE(edits.ok() || absl::IsNotFound(edits.status()) ||
                    (absl::IsFailedPrecondition(edits.status()) && from <= BeginOfLog()))
            << edits.status();
        break;
      }
      case 10: {
        // The layer shows the fold of what is left.
        const auto rebuilt = map_.Run(RebuildFusion{"things", "", ""});
        ASSERT_TRUE(rebuilt.ok()) << rebuilt.status();
        EXPECT_THAT(*rebuilt, IsEmpty());
        break;
      }
      default: {
        const absl::Duration late = UniformInt(rng_, 0, 3) > 0
                                        ? absl::ZeroDuration()
                                        : absl::Seconds(UniformInt(rng_, 0, 19));
        const Observation observation =
            See(absl::StrCat("robot ", UniformInt(rng_, 0, 2)), ++sequence_, now_ - late, rng_);
        for (FusedMap* map : {&map_, &oracle_}) ASSERT_TRUE(map->Observe(observation).ok());
        break;
      }
    }
    ASSERT_EQ(map_.Objects(), oracle_.Objects()) << "step " << step;
  }
  EXPECT_LT(map_.Log().size(), oracle_.Log().size());
}

TEST_P(EvidenceRetentionTest, EvidenceIsKeptForItsAgeAndLittleLonger) {
  for (int i = 0; i < 400; ++i) {
    ASSERT_NO_FATAL_FAILURE(Observe("a"));
    if (!Forget()) continue;
    EXPECT_LE(BeginOfLog(), now_ - kAge);
    EXPECT_GE(BeginOfLog(), now_ - 2 * kAge);
  }
  EXPECT_GE(map_.Log().size(), 60u);
  EXPECT_LE(map_.Log().size(), 120u);
}

TEST_P(EvidenceRetentionTest, ForgottenObservationsAreNotTakenForNewOnes) {
  const Observation first = See("a", 0, now_, rng_);
  ASSERT_EQ(*map_.Observe(first), ObservationOutcome::kAccepted);
  ASSERT_EQ(*oracle_.Observe(first), ObservationOutcome::kAccepted);
  ASSERT_NO_FATAL_FAILURE(ObserveUntilSomethingIsForgotten("b"));
  const std::vector<SemanticObject> before = map_.Objects();
  for (const bool restarts : {false, true}) {
    if (restarts) map_.Restart();
    EXPECT_EQ(*map_.Observe(first), ObservationOutcome::kDuplicate);
    // Nobody knows any more whether it is the same one.
    EXPECT_EQ(*map_.Observe(See("a", 0, now_, rng_)), ObservationOutcome::kDuplicate);
    // A robot that never sent anything, and is late only for the layer.
    EXPECT_EQ(*map_.Observe(See("c", 0, BeginOfLog() - absl::Milliseconds(1), rng_)),
              ObservationOutcome::kRefusedLate);
    EXPECT_EQ(map_.Objects(), before);
  }
  EXPECT_EQ(*map_.Observe(See("c", 1, BeginOfLog() + absl::Seconds(0.5), rng_)),
            ObservationOutcome::kAccepted);
}

TEST_P(EvidenceRetentionTest, ChangesOfForgottenObservationsAreRefused) {
  ASSERT_NO_FATAL_FAILURE(ObserveUntilSomethingIsForgotten("a"));
  ASSERT_NO_FATAL_FAILURE(Observe("b"));
  const std::vector<SemanticObject> before = map_.Objects();
  const absl::Status status = map_.Run(RetractObservations{"things", "a"}).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("--observation_age"));
  EXPECT_EQ(map_.Objects(), before);
  const PoseCorrection correction{"a", {{BeginOfLog(), PlanarTransform()}}};
  const absl::Status uncorrected = map_.Run(CorrectPoses{"things", "", {correction}}).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(uncorrected)) << uncorrected;
  EXPECT_EQ(map_.Objects(), before);
  // Nothing of the other robot is forgotten.
  EXPECT_TRUE(map_.Run(RetractObservations{"things", "b"}).ok());
  EXPECT_TRUE(
      map_.Run(RetractObservations{"things", "a", BeginOfLog() + absl::Nanoseconds(1)}).ok());
  EXPECT_THAT(map_.Log(), IsEmpty());
}

TEST_P(EvidenceRetentionTest, OtherParametersCountForWhatIsLeft) {
  ASSERT_NO_FATAL_FAILURE(ObserveUntilSomethingIsForgotten("a"));
  const size_t log_size = map_.Log().size();
  const absl::Status status = map_.Run(RebuildFusion{"things", "paper", ""}).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("--observation_age"));
  EXPECT_TRUE(map_.Run(RebuildFusion{"things", "", ""}).ok());
  EXPECT_EQ(map_.Log().size(), log_size);
}

TEST_P(EvidenceRetentionTest, FactsGoOnWithTheirNumbers) {
  SemanticObject lamp;
  lamp.label = "lamp";
  lamp.shape = *Shape::MakePoint({9, 9});
  ASSERT_NO_FATAL_FAILURE(Observe("a"));
  ASSERT_TRUE(map_.Edit({{PutObject{"things", lamp, ""}}}).ok());
  ASSERT_NO_FATAL_FAILURE(ObserveUntilSomethingIsForgotten("a"));
  map_.Restart();
  ASSERT_TRUE(map_.Edit({{PutObject{"things", lamp, ""}}}).ok());
  EXPECT_EQ(map_.Log().back().key.number, 2);
}

TEST_P(EvidenceRetentionTest, UnreadableBaseIsDamage) {
  ASSERT_NO_FATAL_FAILURE(ObserveUntilSomethingIsForgotten("a"));
  const storage::FusionBase base{{{AtSecond(0), "a", 1}, 0}, 0, "no state"};
  const auto strategy = fusion::MakeStrategy(GetParam(), "");
  ASSERT_TRUE(strategy.ok());
  EXPECT_TRUE(absl::IsDataLoss(BeginningOfLog(base, **strategy).status()));
}

// Its states can't be read.
class UnreadableTally : public TallyStrategy {
 public:
  UnreadableTally() : TallyStrategy("tally") {}

  absl::StatusOr<fusion::StatePtr> Decode(absl::string_view) const override {
    return absl::DataLossError("of another version");
  }
};

TEST(UnreadableStateTest, DoesNotBecomeTheBase) {
  FusedMap map(
      [](absl::string_view, absl::string_view) { return std::make_unique<UnreadableTally>(); });
  map.options().entries_per_stored_checkpoint = 1;
  map.options().commit_clock = [] { return AtSecond(0); };
  hypermap::testing::Rng rng(1);
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(map.Observe(See("a", i, AtSecond(i), rng)).ok());
  const auto moved = map.fusion().ForgetEvidence(absl::InfiniteFuture());
  ASSERT_TRUE(moved.ok()) << moved.status();
  EXPECT_THAT(*moved, IsEmpty());
  EXPECT_EQ(map.Log().size(), 5u);
}

INSTANTIATE_TEST_SUITE_P(Strategies, EvidenceRetentionTest, ::testing::Values("evidence", "paper"));

}  // namespace
}  // namespace hypermap::server
