// Steps that are repeated give the fold of the log to the last bit, whatever arrives late.
#include "map/fusion/evidence_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "map/fusion/strategy.h"
#include "map/fusion/testing/scene.h"
#include "tests/support/random_map.h"

namespace hypermap::fusion {
namespace {

using hypermap::testing::Rng;
using hypermap::testing::Uniform;
using hypermap::testing::UniformInt;

// Boxes at places 6 m apart, so that views of neighbouring places overlap. Some overlap each other,
// so that tracks are merged.
std::vector<SceneBox> Boxes(Rng& rng, int places) {
  std::vector<SceneBox> boxes;
  for (int place = 0; place < places; ++place) {
    for (int i = 0; i < 4; ++i) {
      const double x = 6.0 * place + Uniform(rng, 1.5, 3.0);
      const double y = Uniform(rng, -0.8, 0.6);
      const double side = Uniform(rng, 0.1, 0.5);
      boxes.push_back({UniformInt(rng, 0, 2) == 0 ? "chair" : "box",
                       Box{{x, y}, {x + side, y + side}},
                       {0.0, Uniform(rng, 0.2, 0.9)}});
    }
  }
  return boxes;
}

// What a robot sees, sometimes with things that are missed, taken for another, or gone.
Observation Look(Rng& rng, std::vector<SceneBox> boxes, int places, int64_t number) {
  SceneDetector detector{.score = Uniform(rng, 0.3, 1.0),
                         .pose_error_x = Uniform(rng, -0.05, 0.05),
                         .pose_error_y = Uniform(rng, -0.05, 0.05)};
  const auto any = [&] { return UniformInt(rng, 0, static_cast<int>(boxes.size()) - 1); };
  if (UniformInt(rng, 0, 2) == 0) detector.missed.push_back(any());
  if (UniformInt(rng, 0, 4) == 0) detector.called[any()] = "bin";
  if (UniformInt(rng, 0, 2) == 0) boxes.erase(boxes.begin() + any());
  Observation look =
      Observe(boxes, {.x = 6.0 * UniformInt(rng, 0, places - 1), .y = Uniform(rng, -0.3, 0.3)},
              number, detector, absl::StrCat("robot ", UniformInt(rng, 0, 2)));
  if (UniformInt(rng, 0, 9) == 0) look.depth = std::nullopt;
  return look;
}

void ExpectSame(const Strategy& strategy, const StatePtr& state, const StatePtr& expected) {
  ASSERT_EQ(strategy.Encode(state), strategy.Encode(expected));
  const auto objects = strategy.Objects(state);
  const auto expected_objects = strategy.Objects(expected);
  ASSERT_EQ(objects.size(), expected_objects.size());
  for (size_t i = 0; i < objects.size(); ++i) {
    ASSERT_EQ(objects[i].track, expected_objects[i].track);
    ASSERT_EQ(*objects[i].object, *expected_objects[i].object);
  }
}

// The objects of a state, as they follow from those of another one.
void ExpectChangesLeadTo(const Strategy& strategy, const StatePtr& before, const StatePtr& after) {
  std::map<TrackKey, ObjectPtr> objects;
  for (const FusedObject& object : strategy.Objects(before)) objects[object.track] = object.object;
  const auto changed = strategy.ChangedObjects(before, after);
  ASSERT_TRUE(changed.has_value());
  for (const FusedObject& object : *changed) {
    if (object.object) {
      objects[object.track] = object.object;
    } else {
      ASSERT_EQ(objects.erase(object.track), 1u);
    }
  }
  std::map<TrackKey, ObjectPtr> expected;
  for (const FusedObject& object : strategy.Objects(after)) expected[object.track] = object.object;
  ASSERT_EQ(objects, expected);
}

// A log that is folded again from each late observation on, with the steps that are known.
class Log {
 public:
  explicit Log(const Strategy* strategy) : strategy_(strategy) {}

  void Arrive(std::shared_ptr<const Observation> observation) {
    const auto is_before = [](const Entry& entry, const Observation& other) {
      return KeyOf(*entry.observation) < KeyOf(other);
    };
    auto at = std::lower_bound(entries_.begin(), entries_.end(), *observation, is_before);
    at = entries_.insert(at, Entry{std::move(observation), nullptr, nullptr});
    StatePtr state = at == entries_.begin() ? strategy_->Initial() : std::prev(at)->after;
    for (; at != entries_.end(); ++at) {
      const FoldStepPtr known = at->step;
      state = strategy_->FoldAgain(state, *at->observation, &at->step);
      if (known) ++(known == at->step ? repeated_ : folded_again_);
      at->after = state;
    }
  }
  StatePtr state() const { return entries_.back().after; }
  StatePtr FoldedInOrder() const {
    StatePtr state = strategy_->Initial();
    for (const Entry& entry : entries_) state = strategy_->Fold(state, *entry.observation, nullptr);
    return state;
  }
  int repeated() const { return repeated_; }
  int folded_again() const { return folded_again_; }

 private:
  struct Entry {
    std::shared_ptr<const Observation> observation;
    FoldStepPtr step;
    StatePtr after;
  };
  const Strategy* const strategy_;
  std::vector<Entry> entries_;
  int repeated_ = 0;
  int folded_again_ = 0;
};

TEST(EvidenceStepTest, AnyOrderOfArrivalGivesTheFoldInOrder) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  const auto strategy = *MakeStrategy("evidence", ParametersOfNewLayer("evidence", ""));
  int repeated = 0;
  int folded_again = 0;
  for (int trial = 0; trial < 6; ++trial) {
    const int places = 1 + trial;
    const std::vector<SceneBox> boxes = Boxes(rng, places);
    std::vector<Observation> arrivals;
    for (int i = 0; i < 60; ++i) arrivals.push_back(Look(rng, boxes, places, i));
    // The same frames under another name, which count once.
    for (int i = 0; i < 3; ++i) {
      Observation copy = arrivals[UniformInt(rng, 0, 59)];
      copy.robot = "copy";
      copy.sequence = 100 + i;
      copy.stamp += absl::Milliseconds(UniformInt(rng, -20, 20));
      arrivals.push_back(std::move(copy));
    }
    // Late by up to 15 entries.
    std::vector<std::pair<int, size_t>> order;
    for (size_t i = 0; i < arrivals.size(); ++i) {
      order.emplace_back(static_cast<int>(i) + UniformInt(rng, 0, 15), i);
    }
    std::sort(order.begin(), order.end());
    Log log(strategy.get());
    StatePtr before = strategy->Initial();
    for (const auto& [at, i] : order) {
      log.Arrive(std::make_shared<const Observation>(arrivals[i]));
      ASSERT_NO_FATAL_FAILURE(ExpectSame(*strategy, log.state(), log.FoldedInOrder()))
          << "trial " << trial << ", observation " << i;
      ASSERT_NO_FATAL_FAILURE(ExpectChangesLeadTo(*strategy, before, log.state()));
      before = log.state();
    }
    repeated += log.repeated();
    folded_again += log.folded_again();
  }
  // Both happen, so that both are tested.
  EXPECT_GT(repeated, 100);
  EXPECT_GT(folded_again, 100);
}

TEST(EvidenceStepTest, ObservationsElsewhereAreNotFoldedAgain) {
  Rng rng(1);
  const auto strategy = *MakeStrategy("evidence", ParametersOfNewLayer("evidence", ""));
  // Farther apart than a camera sees.
  std::vector<SceneBox> boxes;
  for (const double x : {2.0, 102.0}) {
    boxes.push_back({"box", Box{{x, -0.2}, {x + 0.4, 0.2}}, {0.0, 0.5}});
  }
  Log log(strategy.get());
  for (int i = 0; i < 40; ++i) {
    if (i == 20) continue;
    log.Arrive(std::make_shared<const Observation>(
        Observe(boxes, {.x = i % 2 == 0 ? 0.0 : 100.0}, i, {.score = Uniform(rng, 0.3, 1.0)})));
  }
  // Its score gives each later one another rank, whose effect is computed without a fold.
  log.Arrive(std::make_shared<const Observation>(Observe(boxes, {.x = 0.0}, 20, {.score = 0.1})));
  EXPECT_EQ(log.repeated(), 10);
  EXPECT_EQ(log.folded_again(), 9);
  ExpectSame(*strategy, log.state(), log.FoldedInOrder());
}

}  // namespace
}  // namespace hypermap::fusion
