// Both strategies in made-up worlds with a known outcome: where the published rule fails, and how
// the evidence strategy does there.
#include "map/fusion/strategy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <random>

#include "absl/strings/str_cat.h"
#include "map/fusion/testing/scene.h"
#include "map/geometry/overlap.h"
#include "tests/support/random_map.h"

namespace hypermap::fusion {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

SceneBox Chair() { return {"chair", Box{{2.0, -0.25}, {2.5, 0.25}}, {0.0, 0.9}}; }
SceneBox Table() { return {"diningtable", Box{{1.6, -0.5}, {2.6, 0.5}}, {0.65, 0.72}}; }
SceneBox Vase() { return {"vase", Box{{1.9, -0.1}, {2.1, 0.1}}, {0.72, 1.0}}; }

std::unique_ptr<Strategy> Make(const std::string& name) {
  auto strategy = MakeStrategy(name, ParametersOfNewLayer(name, ""));
  EXPECT_TRUE(strategy.ok()) << strategy.status();
  return *std::move(strategy);
}

StatePtr FoldAll(const Strategy& strategy, const std::vector<Observation>& observations) {
  StatePtr state = strategy.Initial();
  for (const Observation& observation : observations) {
    EXPECT_TRUE(Validate(observation).ok()) << Validate(observation);
    state = strategy.Fold(state, observation, nullptr);
  }
  return state;
}

std::vector<std::string> Labels(const Strategy& strategy, const StatePtr& state) {
  std::vector<std::string> labels;
  for (const FusedObject& object : strategy.Objects(state)) labels.push_back(object.object->label);
  std::sort(labels.begin(), labels.end());
  return labels;
}

// Folds an observation that affects at most one track, and returns the existence that the report
// states for it; -1 if no track was affected.
double ExistenceAfter(const Strategy& strategy, StatePtr* state, const Observation& observation) {
  FoldReport report;
  *state = strategy.Fold(*state, observation, &report);
  EXPECT_LE(report.existence.size(), 1u);
  return report.existence.empty() ? -1.0 : report.existence.begin()->second;
}

std::vector<Observation> Looks(const std::vector<SceneBox>& scene, int count,
                               const SceneDetector& detector = {}) {
  std::vector<Observation> looks;
  for (int i = 0; i < count; ++i) {
    looks.push_back(Observe(scene, {.y = 0.02 * i}, i, detector));
  }
  return looks;
}

class BothTest : public ::testing::TestWithParam<std::string> {};

TEST_P(BothTest, WhatIsSeenAgainAndAgainIsOneObject) {
  const auto strategy = Make(GetParam());
  const StatePtr state = FoldAll(*strategy, Looks({Chair()}, 8));
  ASSERT_THAT(Labels(*strategy, state), ElementsAre("chair"));
  const ObjectPtr object = strategy->Objects(state).front().object;
  EXPECT_GT(object->existence, 0.8);
  EXPECT_EQ(object->attributes.at("observations"), AttributeValue(int64_t{8}));
}

TEST_P(BothTest, NothingComesOfNothing) {
  const auto strategy = Make(GetParam());
  EXPECT_THAT(Labels(*strategy, FoldAll(*strategy, Looks({}, 5))), IsEmpty());
}

TEST_P(BothTest, AStateDecodedGoesOnAsTheOneEncoded) {
  const auto strategy = Make(GetParam());
  const std::vector<SceneBox> scene = {
      Table(), Vase(), {"bin", Box{{2.8, 0.7}, {3.1, 1.0}}, {0.0, 0.4}}};
  std::mt19937_64 rng(hypermap::testing::TestSeed());
  std::normal_distribution<double> error(0.0, 0.04);
  StatePtr one = strategy->Initial();
  StatePtr other = strategy->Initial();
  for (int i = 0; i < 20; ++i) {
    const Observation look =
        Observe(scene, {.y = 0.03 * i, .yaw_rad = -0.01 * i}, i,
                {.score = 0.5 + 0.02 * i, .pose_error_x = error(rng), .pose_error_y = error(rng)});
    one = strategy->Fold(one, look, nullptr);
    auto decoded = strategy->Decode(strategy->Encode(other));
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    other = strategy->Fold(*decoded, look, nullptr);
    ASSERT_EQ(strategy->Encode(one), strategy->Encode(other)) << "after look " << i;
    const auto a = strategy->Objects(one);
    const auto b = strategy->Objects(other);
    ASSERT_EQ(a.size(), b.size());
    for (size_t k = 0; k < a.size(); ++k) {
      EXPECT_EQ(a[k].track, b[k].track);
      EXPECT_EQ(*a[k].object, *b[k].object);
    }
  }
}

TEST_P(BothTest, FoldingLeavesTheStateBeforeAsItWas) {
  const auto strategy = Make(GetParam());
  const auto looks = Looks({Chair()}, 6);
  const StatePtr before = FoldAll(*strategy, {looks.begin(), looks.begin() + 5});
  const std::string bytes = strategy->Encode(before);
  strategy->Fold(before, looks[5], nullptr);
  EXPECT_EQ(strategy->Encode(before), bytes);
}

TEST_P(BothTest, BytesThatAreNoStateAreRefused) {
  const auto strategy = Make(GetParam());
  const std::string whole = strategy->Encode(FoldAll(*strategy, Looks({Chair()}, 3)));
  for (const std::string& bytes :
       {std::string(), std::string("nonsense"), whole.substr(0, whole.size() / 2)}) {
    EXPECT_EQ(strategy->Decode(bytes).status().code(), absl::StatusCode::kDataLoss);
  }
  const auto another = Make(GetParam() == "paper" ? "evidence" : "paper");
  EXPECT_EQ(another->Decode(whole).status().code(), absl::StatusCode::kDataLoss);
}

TEST(EvidenceCodecTest, CellsThatAreNowhereAreDamage) {
  const auto strategy = Make("evidence");
  const std::string whole = strategy->Encode(FoldAll(*strategy, Looks({Chair()}, 3)));
  for (const double resolution : {-0.1, 0.0, 1e300}) {
    nlohmann::json state = nlohmann::json::from_cbor(whole);
    state["content"]["tracks"][0]["shape"]["resolution"] = resolution;
    const std::vector<uint8_t> bytes = nlohmann::json::to_cbor(state);
    EXPECT_EQ(strategy->Decode(std::string(bytes.begin(), bytes.end())).status().code(),
              absl::StatusCode::kDataLoss)
        << resolution;
  }
}

TEST_P(BothTest, WhatAnOperatorPinnedStaysAsItIs) {
  const auto strategy = Make(GetParam());
  StatePtr state = FoldAll(*strategy, Looks({Chair()}, 8));
  const FusedObject seen = strategy->Objects(state).front();
  SemanticObject pinned = *seen.object;
  pinned.label = "armchair";
  pinned.shape = Polygon::FromBox(Box{{2.0, -0.3}, {2.6, 0.3}});
  state = strategy->Fold(state, {OperatorFact::Kind::kPin, seen.track, pinned});
  // Eight more views of the chair, then twenty of the empty place.
  for (int i = 8; i < 36; ++i) {
    const std::vector<SceneBox> scene = i < 16 ? std::vector{Chair()} : std::vector<SceneBox>{};
    state = strategy->Fold(state, Observe(scene, {}, i, {.called = {{0, "armchair"}}}), nullptr);
  }
  const auto objects = strategy->Objects(state);
  ASSERT_THAT(objects, SizeIs(1));
  EXPECT_EQ(objects.front().track, seen.track);
  EXPECT_EQ(objects.front().object->label, "armchair");
  EXPECT_EQ(objects.front().object->shape, pinned.shape);
}

// The kinds of shapes that an operator may pin, besides polygons.
std::vector<Shape> LineAndPoint() {
  return {*LineString::Make({{2.0, -0.3}, {2.3, 0.0}, {2.6, 0.3}}), *Shape::MakePoint({2.3, 0.0})};
}

TEST_P(BothTest, PinnedLineOrPointStaysAsItIs) {
  const auto strategy = Make(GetParam());
  for (const Shape& shape : LineAndPoint()) {
    SCOPED_TRACE(ShapeKindName(shape.kind()).data());
    StatePtr state = FoldAll(*strategy, Looks({Chair()}, 8));
    const FusedObject seen = strategy->Objects(state).front();
    SemanticObject pinned = *seen.object;
    pinned.shape = shape;
    state = strategy->Fold(state, {OperatorFact::Kind::kPin, seen.track, pinned});
    // Twenty views of the empty place.
    for (int i = 8; i < 28; ++i) state = strategy->Fold(state, Observe({}, {}, i), nullptr);
    const auto objects = strategy->Objects(state);
    ASSERT_THAT(objects, SizeIs(1));
    EXPECT_EQ(objects.front().track, seen.track);
    EXPECT_EQ(objects.front().object->shape, shape);
  }
}

TEST_P(BothTest, PinnedLineOrPointOnAnEmptyPlaceIsShown) {
  const auto strategy = Make(GetParam());
  for (const Shape& shape : LineAndPoint()) {
    SCOPED_TRACE(ShapeKindName(shape.kind()).data());
    SemanticObject sill;
    sill.label = "sill";
    sill.shape = shape;
    StatePtr state =
        strategy->Fold(strategy->Initial(), {OperatorFact::Kind::kPin, "operator/1", sill});
    state = strategy->Fold(state, Observe({}, {}, 0), nullptr);
    const auto objects = strategy->Objects(state);
    ASSERT_THAT(objects, SizeIs(1));
    EXPECT_EQ(objects.front().track, "operator/1");
    EXPECT_EQ(objects.front().object->shape, shape);
    state = strategy->Fold(state, {OperatorFact::Kind::kRemove, "operator/1", sill});
    EXPECT_THAT(strategy->Objects(state), IsEmpty());
  }
}

TEST_P(BothTest, PinnedLineOrPointComesBackFromBytes) {
  const auto strategy = Make(GetParam());
  for (const Shape& shape : LineAndPoint()) {
    SCOPED_TRACE(ShapeKindName(shape.kind()).data());
    StatePtr state = FoldAll(*strategy, Looks({Chair()}, 8));
    const FusedObject seen = strategy->Objects(state).front();
    SemanticObject pinned = *seen.object;
    pinned.shape = shape;
    state = strategy->Fold(state, {OperatorFact::Kind::kPin, seen.track, pinned});
    const std::string bytes = strategy->Encode(state);
    const auto restored = strategy->Decode(bytes);
    ASSERT_TRUE(restored.ok()) << restored.status();
    EXPECT_EQ(strategy->Encode(*restored), bytes);
    EXPECT_EQ(*strategy->Objects(*restored).front().object,
              *strategy->Objects(state).front().object);
  }
}

TEST_P(BothTest, WhatAnOperatorPinnedKeepsItsEndThroughARestart) {
  const auto strategy = Make(GetParam());
  StatePtr state = FoldAll(*strategy, Looks({Chair()}, 8));
  const FusedObject seen = strategy->Objects(state).front();
  SemanticObject pinned = *seen.object;
  pinned.expires_at = absl::FromUnixNanos(1'234'567'890'123);
  state = strategy->Fold(state, {OperatorFact::Kind::kPin, seen.track, pinned});
  const auto restored = strategy->Decode(strategy->Encode(state));
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ(strategy->Objects(state).front().object->expires_at, pinned.expires_at);
  EXPECT_EQ(*strategy->Objects(*restored).front().object, *strategy->Objects(state).front().object);
}

TEST_P(BothTest, FactsFoldedTogetherGiveTheStateOfOneByOne) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng rng(seed);
  const auto strategy = Make(GetParam());
  const StatePtr before = FoldAll(*strategy, Looks({Table(), Vase()}, 8));
  const std::string bytes_before = strategy->Encode(before);
  StatePtr one_by_one = before;
  const std::unique_ptr<FactFold> together = strategy->FoldFacts(before);
  for (int i = 0; i < 200; ++i) {
    OperatorFact fact;
    if (i % 4 == 3) fact.kind = OperatorFact::Kind::kRemove;
    fact.track = absl::StrCat("operator/", hypermap::testing::UniformInt(rng, 0, 200));
    const Point at{hypermap::testing::Uniform(rng, 0, 6), hypermap::testing::Uniform(rng, -3, 3)};
    fact.object = hypermap::testing::RandomObject(rng, at, 0.5);
    one_by_one = strategy->Fold(one_by_one, fact);
    together->Add(fact);
  }
  EXPECT_EQ(strategy->Encode(together->Finish()), strategy->Encode(one_by_one));
  EXPECT_EQ(strategy->Encode(before), bytes_before);
}

TEST_P(BothTest, WhatAnOperatorRemovedDoesNotComeBack) {
  const auto strategy = Make(GetParam());
  StatePtr state = FoldAll(*strategy, Looks({Chair()}, 8));
  const FusedObject seen = strategy->Objects(state).front();
  state = strategy->Fold(state, {OperatorFact::Kind::kRemove, seen.track, *seen.object});
  EXPECT_THAT(strategy->Objects(state), IsEmpty());
  for (int i = 8; i < 28; ++i) {
    state = strategy->Fold(state, Observe({Chair()}, {}, i), nullptr);
    EXPECT_THAT(strategy->Objects(state), IsEmpty()) << "after look " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Strategies, BothTest, ::testing::Values("evidence", "paper"),
                         [](const auto& info) { return info.param; });

// Known weaknesses of the published rule and of its implementation.

TEST(WeaknessTest, AHalfSeenThingThatIsGoneIsForgotten) {
  // The view ends in the middle of the place, so that its hull never covers all of it.
  const SceneCamera aside{.y = -1.35};
  for (const char* name : {"paper", "evidence"}) {
    const auto strategy = Make(name);
    StatePtr state = FoldAll(*strategy, Looks({Chair()}, 8));
    for (int i = 8; i < 48; ++i) {
      state = strategy->Fold(state, Observe({}, aside, i), nullptr);
    }
    if (std::string(name) == "paper") {
      EXPECT_THAT(Labels(*strategy, state), ElementsAre("chair")) << "the baseline never forgets";
    } else {
      EXPECT_THAT(Labels(*strategy, state), IsEmpty());
    }
  }
}

TEST(WeaknessTest, ADoubtfulDetectionOrTwoIsNoObject) {
  for (const char* name : {"paper", "evidence"}) {
    const auto strategy = Make(name);
    StatePtr state = FoldAll(*strategy, Looks({Chair()}, 8));
    const SceneBox ghost{"couch", Box{{3.2, 0.6}, {3.8, 1.2}}, {0.0, 0.7}};
    for (int i = 8; i < 10; ++i) {
      state = strategy->Fold(state, Observe({Chair(), ghost}, {}, i, {.score = 0.2}), nullptr);
    }
    if (std::string(name) == "paper") {
      EXPECT_THAT(Labels(*strategy, state), ElementsAre("chair", "couch"));
    } else {
      EXPECT_THAT(Labels(*strategy, state), ElementsAre("chair"));
    }
  }
}

TEST(WeaknessTest, AnArmchairIsNotAtOnceChairAndCouch) {
  for (const char* name : {"paper", "evidence"}) {
    const auto strategy = Make(name);
    StatePtr state = strategy->Initial();
    for (int i = 0; i < 12; ++i) {
      SceneDetector detector;
      if (i % 3 == 2) detector.called[0] = "couch";
      state = strategy->Fold(state, Observe({Chair()}, {}, i, detector), nullptr);
    }
    if (std::string(name) == "paper") {
      EXPECT_THAT(Labels(*strategy, state), ElementsAre("chair", "couch"));
      continue;
    }
    const auto objects = strategy->Objects(state);
    ASSERT_THAT(objects, SizeIs(1));
    EXPECT_EQ(objects.front().object->label, "chair");
    EXPECT_NEAR(objects.front().object->classes.at("chair"), 2.0 / 3.0, 0.1);
    EXPECT_NEAR(objects.front().object->classes.at("couch"), 1.0 / 3.0, 0.1);
  }
}

TEST(WeaknessTest, PoseErrorMakesNoDuplicates) {
  // Two visits that disagree by 9 cm about the position of a small thing.
  const SceneBox mug{"cup", Box{{1.5, 0.5}, {1.58, 0.58}}, {0.0, 0.25}};
  for (const char* name : {"paper", "evidence"}) {
    const auto strategy = Make(name);
    StatePtr state = strategy->Initial();
    int64_t cups = 0;
    for (int i = 0; i < 20; ++i) {
      const double error = i < 10 ? 0.045 : -0.045;
      const int64_t sequence = i < 10 ? i : 100 + i;
      state = strategy->Fold(state, Observe({mug, Chair()}, {}, sequence, {.pose_error_y = error}),
                             nullptr);
      const auto labels = Labels(*strategy, state);
      cups = std::max<int64_t>(cups, std::count(labels.begin(), labels.end(), "cup"));
    }
    EXPECT_EQ(cups, std::string(name) == "paper" ? 2 : 1) << name;
  }
}

TEST(WeaknessTest, AShapeSeenInPartsIsCompleted) {
  // A long bench; each view shows one end of it.
  const SceneBox bench{"bench", Box{{1.8, -2.0}, {2.3, 2.0}}, {0.3, 0.45}};
  const Polygon truth = Polygon::FromBox(bench.footprint);
  std::map<std::string, double> iou;
  for (const char* name : {"paper", "evidence"}) {
    const auto strategy = Make(name);
    StatePtr state = strategy->Initial();
    for (int i = 0; i < 40; ++i) {
      const double y = -1.6 + 3.2 * i / 39.0;
      state = strategy->Fold(state, Observe({bench}, {.y = y, .pitch_rad = 0.35}, i), nullptr);
    }
    for (const FusedObject& object : strategy->Objects(state)) {
      iou[name] = std::max(iou[name], Iou(object.object->shape.polygon(), truth));
    }
  }
  EXPECT_LT(iou["paper"], 0.7);
  EXPECT_GT(iou["evidence"], 0.85);
}

// Promises that only the evidence strategy makes.

TEST(EvidenceTest, WhatStandsOnAnotherThingStaysApart) {
  const auto strategy = Make("evidence");
  const StatePtr state = FoldAll(*strategy, Looks({Table(), Vase()}, 10));
  EXPECT_THAT(Labels(*strategy, state), ElementsAre("diningtable", "vase"));
}

TEST(EvidenceTest, NeighboursOfOneClassStayApart) {
  const auto strategy = Make("evidence");
  std::vector<SceneBox> books;
  for (int i = 0; i < 4; ++i) {
    books.push_back({"book", Box{{1.5, 0.06 * i}, {1.7, 0.06 * i + 0.05}}, {0.8, 1.0}});
  }
  const StatePtr state = FoldAll(*strategy, Looks(books, 12));
  EXPECT_THAT(Labels(*strategy, state), SizeIs(4));
}

TEST(EvidenceTest, AThingTakenAwayIsGoneWithinTenClearViews) {
  for (const SceneBox& thing :
       {Chair(), SceneBox{"cup", Box{{1.4, -0.05}, {1.5, 0.05}}, {0.0, 0.15}}}) {
    const auto strategy = Make("evidence");
    // Enough frames for the existence to reach its upper bound.
    StatePtr state = FoldAll(*strategy, Looks({thing}, 40));
    ASSERT_THAT(Labels(*strategy, state), SizeIs(1)) << thing.label;
    double existence = 1.0;
    int views = 0;
    while (existence >= 0.1 && views < 20) {
      existence = ExistenceAfter(*strategy, &state, Observe({}, {}, 40 + views));
      ++views;
    }
    EXPECT_LE(views, 10) << thing.label;
    EXPECT_THAT(Labels(*strategy, state), IsEmpty()) << thing.label;
  }
}

TEST(EvidenceTest, AThingThatIsHiddenStaysAsItWas) {
  const auto strategy = Make("evidence");
  StatePtr state = FoldAll(*strategy, Looks({Chair()}, 10));
  const double before = strategy->Objects(state).front().object->existence;
  const SceneBox screen{"screen", Box{{1.2, -1.5}, {1.25, 1.5}}, {0.0, 2.2}};
  for (int i = 10; i < 40; ++i) {
    state = strategy->Fold(state, Observe({Chair(), screen}, {}, i, {.missed = {1}}), nullptr);
  }
  const auto objects = strategy->Objects(state);
  ASSERT_THAT(objects, SizeIs(1));
  EXPECT_EQ(objects.front().object->existence, before);
}

TEST(EvidenceTest, TheMeanOfVisitsWithOppositePoseErrorIsWhereTheThingIs) {
  const auto strategy = Make("evidence");
  StatePtr state = strategy->Initial();
  for (int i = 0; i < 20; ++i) {
    const double error = i % 2 == 0 ? 0.05 : -0.05;
    // One visit a minute.
    state =
        strategy->Fold(state, Observe({Chair()}, {}, 300 * i, {.pose_error_x = error}), nullptr);
  }
  const auto objects = strategy->Objects(state);
  ASSERT_THAT(objects, SizeIs(1));
  const auto exact = strategy->Objects(FoldAll(*strategy, Looks({Chair()}, 20)));
  ASSERT_THAT(exact, SizeIs(1));
  const Point truth = Centroid(exact.front().object->shape);
  EXPECT_NEAR(Centroid(objects.front().object->shape).x, truth.x, 0.03);
}

TEST(EvidenceTest, AFrameUnderSeveralNamesCountsOnce) {
  const auto strategy = Make("evidence");
  StatePtr one = strategy->Initial();
  StatePtr several = strategy->Initial();
  for (int i = 0; i < 10; ++i) {
    const SceneCamera camera{.y = 0.05 * i};
    const SceneDetector detector{.score = 0.5 + 0.04 * i};
    one = strategy->Fold(one, Observe({Chair(), Table()}, camera, i, detector), nullptr);
    for (const char* robot : {"r", "s", "t", "u"}) {
      const Observation look = Observe({Chair(), Table()}, camera, i, detector, robot);
      auto decoded = strategy->Decode(strategy->Encode(several));
      ASSERT_TRUE(decoded.ok()) << decoded.status();
      several = strategy->Fold(*decoded, look, nullptr);
    }
    EXPECT_EQ(strategy->Encode(several), strategy->Encode(one)) << "after look " << i;
  }
}

TEST(EvidenceTest, WhatAnotherDetectorFindsInAFrameCounts) {
  const auto strategy = Make("evidence");
  const StatePtr one = strategy->Fold(strategy->Initial(), Observe({Chair()}, {}, 1), nullptr);
  const StatePtr both = strategy->Fold(one, Observe({Chair(), Table()}, {}, 1, {}, "s"), nullptr);
  EXPECT_NE(strategy->Encode(both), strategy->Encode(one));
}

TEST(EvidenceTest, LayersStoredByTheFirstVersionCountAFrameUnderEachName) {
  const auto first = *MakeStrategy("evidence", "");
  const StatePtr one = first->Fold(first->Initial(), Observe({Chair()}, {}, 1), nullptr);
  const StatePtr two = first->Fold(one, Observe({Chair()}, {}, 1, {}, "s"), nullptr);
  EXPECT_NE(first->Encode(two), first->Encode(one));
}

TEST(EvidenceTest, EvidenceGoesByTheRankOfAScoreNotByItsScale) {
  // The same stream from a detector whose scores are all in the lower half.
  const SceneBox ghost{"couch", Box{{3.2, 0.6}, {3.8, 1.2}}, {0.0, 0.7}};
  for (const double scale : {1.0, 0.5}) {
    const auto strategy = Make("evidence");
    StatePtr state = strategy->Initial();
    for (int i = 0; i < 40; ++i) {
      const bool stray = i % 10 == 9;
      std::vector<SceneBox> scene = {Chair()};
      if (stray) scene.push_back(ghost);
      Observation look = Observe(scene, {}, i, {.score = 0.9 * scale});
      if (stray) look.detections.back().scores = {{"couch", 0.3 * scale}};
      state = strategy->Fold(state, look, nullptr);
    }
    EXPECT_THAT(Labels(*strategy, state), ElementsAre("chair")) << "scores times " << scale;
  }
}

TEST_P(BothTest, DetectionsOfAnySizeAndPlaceDoNoHarm) {
  const auto strategy = Make(GetParam());
  StatePtr state = strategy->Initial();
  for (int i = 0; i < 8; ++i) {
    Observation look = Observe({Chair()}, {}, i);
    const Detection chair = look.detections.front();
    // Listed before the chair, so that later indexes shift: one far away, one a kilometre wide, and
    // one with a bay.
    Detection odd = chair;
    odd.hull = Polygon::FromBox(Box{{8e8, 8e8}, {8e8 + 1, 8e8 + 1}});
    Detection wide = chair;
    wide.hull = Polygon::FromBox(Box{{-500, -500}, {500, 500}});
    Detection bay = chair;
    bay.hull = *Polygon::Make({{5, 0}, {7, 0}, {7, 2}, {6, 0.5}, {5, 2}});
    look.detections = {odd, wide, bay, chair};
    look.depth->owner.assign(look.depth->owner.size(), 0);
    ASSERT_TRUE(Validate(look).ok()) << Validate(look);
    state = strategy->Fold(state, look, nullptr);
  }
  EXPECT_TRUE(strategy->Decode(strategy->Encode(state)).ok());
}

TEST(ObservationTest, MoreDetectionsThanCanBeToldApartAreRefused) {
  Observation look = Observe({Chair()}, {}, 0);
  look.detections.resize(kMaxDetections + 1, look.detections.front());
  EXPECT_EQ(Validate(look).code(), absl::StatusCode::kInvalidArgument);
}

TEST(MakeStrategyTest, NamesWhatItDoesNotKnow) {
  EXPECT_THAT(StrategyNames(), ElementsAre("evidence", "paper"));
  EXPECT_THAT(std::string(MakeStrategy("best", "").status().message()),
              ::testing::HasSubstr("there is no 'best'"));
  for (const char* parameters :
       {"[]", "{", "{\"gate\": 7}", "{\"gate\": \"x\"}", "{\"gait\": 1}"}) {
    EXPECT_EQ(MakeStrategy("evidence", parameters).status().code(),
              absl::StatusCode::kInvalidArgument)
        << parameters;
  }
  EXPECT_TRUE(MakeStrategy("evidence", "{\"gate\": 0.2}").ok());
}

}  // namespace
}  // namespace hypermap::fusion
