// Late observations wait for a fold that is made in advance, and hold nobody up.
#include "server/session/late_observations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "server/fusion/testing/tally_strategy.h"
#include "server/session/testing/fused_site.h"
#include "tests/support/random_map.h"

namespace hypermap::server {
namespace {

// Entries of the log of which a late observation makes the writer fold most.
constexpr int kEntries = 1000;

// Calls `hook` with the number of the fold before each fold of an observation.
class HookedTally : public TallyStrategy {
 public:
  struct Hook {
    std::atomic<int> num_folds = 0;
    std::function<void(int)> hook = [](int) {};
  };
  explicit HookedTally(Hook* hook) : TallyStrategy("tally"), hook_(hook) {}

  fusion::StatePtr Fold(const fusion::StatePtr& state, const Observation& observation,
                        fusion::FoldReport* report) const override {
    hook_->hook(++hook_->num_folds);
    return TallyStrategy::Fold(state, observation, report);
  }

 private:
  Hook* const hook_;
};

class LateObservationsTest : public ::testing::Test {
 protected:
  LateObservationsTest() {
    site_.options().fusion.make_strategy = [this](absl::string_view, absl::string_view) {
      return std::make_unique<HookedTally>(&hook_);
    };
    site_.options().fusion.clock = [] { return kBegin + absl::Seconds(kEntries); };
    site_.Restart();
    site_.Start();
    std::vector<Observation> log;
    for (int i = 0; i < kEntries; ++i) log.push_back(Sighting("a", i, i, {"cup"}));
    EXPECT_TRUE(site_.Submit(log).get().ok());
    hook_.num_folds = 0;
  }

  // Calls `hook` on the writer's thread when it has folded so many observations from now on.
  void AfterFolds(int number, std::function<void()> hook) {
    hook_.hook = [number, hook = std::move(hook)](int num_folds) {
      if (num_folds == number) hook();
    };
  }
  std::future<Verdicts> SubmitOf(const std::string& client, const Observation& observation,
                                 std::shared_ptr<Cancellation> cancellation = nullptr) {
    ObservationSubmission submission{"things", {observation}, "test"};
    submission.client = client;
    submission.cancellation = std::move(cancellation);
    return site_.Submit(std::move(submission));
  }

  HookedTally::Hook hook_;
  FusedSite site_;
};

TEST_F(LateObservationsTest, EditsAndObservationsOnTimeOvertakeThem) {
  std::atomic<int> edited_after = 0;
  std::atomic<int> observed_after = 0;
  AfterFolds(100, [&] {
    LayerSpec lanes;
    lanes.name = "lanes";
    site_.session().Submit(Submission{{{CreateLayer{lanes}}}, "test", ""},
                           [&](const absl::StatusOr<storage::Receipt>& receipt) {
                             EXPECT_TRUE(receipt.ok()) << receipt.status();
                             edited_after = hook_.num_folds.load();
                           });
    site_.session().Observe({"things", {Sighting("b", 0, kEntries, {"sofa"})}, "test"},
                            [&](const Verdicts& verdicts) {
                              EXPECT_TRUE(verdicts.ok()) << verdicts.status();
                              observed_after = hook_.num_folds.load();
                            });
  });
  const Verdicts late = site_.Submit({Sighting("c", 0, 0.5, {"cup"})}).get();
  ASSERT_TRUE(late.ok()) << late.status();
  EXPECT_EQ(late->front().outcome, ObservationOutcome::kAccepted);
  // They were answered soon after they came.
  EXPECT_GE(edited_after, 100);
  EXPECT_LT(edited_after, 200);
  EXPECT_GE(observed_after, 100);
  EXPECT_LT(observed_after, 200);
  EXPECT_GT(hook_.num_folds, kEntries);
  EXPECT_NE(site_.Find("sofa"), nullptr);
}

TEST_F(LateObservationsTest, LittleLateOnesOvertakeVeryLateOnes) {
  // Observations older than all that is kept in memory are very late.
  site_.Restart();
  for (int i = 0; i < 300; ++i) {
    site_.Observe(Sighting("a", kEntries + i, kEntries + 0.1 * i, {"cup"}));
  }
  hook_.num_folds = 0;
  std::atomic<int> late_after = 0;
  AfterFolds(50, [&] {
    site_.session().Observe({"things", {Sighting("b", 0, kEntries + 9.95, {"sofa"})}, "test"},
                            [&](const Verdicts& verdicts) {
                              EXPECT_TRUE(verdicts.ok()) << verdicts.status();
                              late_after = hook_.num_folds.load();
                            });
  });
  const Verdicts very_late = site_.Submit({Sighting("c", 0, 0.5, {"cup"})}).get();
  ASSERT_TRUE(very_late.ok()) << very_late.status();
  EXPECT_GE(late_after, 50);
  EXPECT_LT(late_after, hook_.num_folds);
}

TEST_F(LateObservationsTest, ARobotsObservationsKeepTheirOrder) {
  // The second one has the name of the first, which is late; the third one is on time.
  auto first = site_.Submit({Sighting("b", 0, 0.5, {"sofa"})});
  auto second = site_.Submit({Sighting("b", 0, kEntries, {"chair"})});
  auto third = site_.Submit({Sighting("b", 1, kEntries, {"bowl"})});
  EXPECT_EQ(first.get()->front().outcome, ObservationOutcome::kAccepted);
  EXPECT_EQ(second.get()->front().outcome, ObservationOutcome::kConflict);
  EXPECT_EQ(third.get()->front().outcome, ObservationOutcome::kAccepted);
}

TEST_F(LateObservationsTest, AreJudgedByTheTimeAtWhichTheyCame) {
  site_.options().fusion.max_lateness = absl::Seconds(100);
  site_.Restart();
  site_.Observe(Sighting("b", 0, kEntries - 50, {"cup"}));
  site_.Observe(Sighting("b", 1, kEntries, {"cup"}));
  // The first of a robot may have any stamp; the second one then is too old.
  auto first = site_.Submit({Sighting("c", 0, 400, {"sofa"})});
  auto old = site_.Submit({Sighting("c", 1, 299, {"sofa"})});
  EXPECT_EQ(first.get()->front().outcome, ObservationOutcome::kAccepted);
  EXPECT_EQ(old.get()->front().outcome, ObservationOutcome::kRefusedLate);
}

TEST_F(LateObservationsTest, OneThatIsSentAgainIsADuplicate) {
  auto first = site_.Submit({Sighting("b", 0, 0.5, {"sofa"})});
  auto again = site_.Submit({Sighting("b", 0, 0.5, {"sofa"})});
  EXPECT_EQ(first.get()->front().outcome, ObservationOutcome::kAccepted);
  EXPECT_EQ(again.get()->front().outcome, ObservationOutcome::kDuplicate);
}

TEST_F(LateObservationsTest, ThoseWhoseCallersHaveGoneAreGivenUp) {
  std::atomic<bool> is_gone = false;
  std::future<Verdicts> other;
  AfterFolds(100, [&] {
    is_gone = true;
    // The work pauses, because another submission waits.
    other = site_.Submit({Sighting("a", kEntries, kEntries, {"cup"})});
  });
  auto gone =
      SubmitOf("one", Sighting("b", 0, 0.5, {"sofa"}),
               std::make_shared<Cancellation>(
                   [&] { return is_gone ? absl::CancelledError("gone") : absl::OkStatus(); },
                   absl::ZeroDuration()));
  EXPECT_TRUE(absl::IsCancelled(gone.get().status()));
  EXPECT_TRUE(other.get().ok());
  EXPECT_LT(hook_.num_folds, kEntries);
  EXPECT_EQ(site_.Find("sofa"), nullptr);
  EXPECT_EQ(SubmitOf("one", Sighting("b", 0, 0.5, {"sofa"})).get()->front().outcome,
            ObservationOutcome::kAccepted);
}

TEST_F(LateObservationsTest, CountInTheQueue) {
  site_.options().limits.max_queue = 4;
  site_.Restart();
  site_.Observe(Sighting("a", kEntries, kEntries, {"cup"}));
  hook_.num_folds = 0;
  std::promise<void> folding;
  std::promise<void> go_on;
  AfterFolds(10, [&] {
    folding.set_value();
    go_on.get_future().wait();
  });
  auto one = SubmitOf("one", Sighting("b", 0, 0.5, {"sofa"}));
  folding.get_future().wait();
  EXPECT_EQ(site_.session().queue_size().submissions, 1);
  auto two = SubmitOf("one", Sighting("b", 1, 0.5, {"sofa"}));
  EXPECT_TRUE(
      absl::IsResourceExhausted(SubmitOf("one", Sighting("b", 2, 0.5, {"sofa"})).get().status()));
  auto three = SubmitOf("two", Sighting("c", 0, 0.5, {"sofa"}));
  auto four = SubmitOf("two", Sighting("c", 1, 0.5, {"sofa"}));
  EXPECT_TRUE(
      absl::IsResourceExhausted(SubmitOf("three", Sighting("d", 0, 1, {"sofa"})).get().status()));
  go_on.set_value();
  for (auto* answer : {&one, &two, &three, &four}) EXPECT_TRUE(answer->get().ok());
  EXPECT_EQ(site_.session().queue_size().submissions, 0);
  EXPECT_EQ(site_.session().queue_size().bytes, 0);
}

TEST_F(LateObservationsTest, SessionThatEndsRefusesThem) {
  std::promise<void> folding;
  AfterFolds(100, [&] { folding.set_value(); });
  auto waiting = site_.Submit({Sighting("b", 0, 0.5, {"sofa"})});
  folding.get_future().wait();
  site_.session().Close();
  EXPECT_TRUE(absl::IsUnavailable(waiting.get().status()));
  site_.Restart();
  EXPECT_EQ(site_.Observe(Sighting("b", 0, 0.5, {"sofa"})).outcome, ObservationOutcome::kAccepted);
}

TEST_F(LateObservationsTest, AreRefusedBeforeTheSessionEnds) {
  std::promise<void> folding;
  AfterFolds(100, [&] { folding.set_value(); });
  auto waiting = site_.Submit({Sighting("b", 0, 0.5, {"sofa"})});
  folding.get_future().wait();
  site_.session().EndWaiting();
  EXPECT_TRUE(absl::IsUnavailable(waiting.get().status()));
  // Others go on.
  EXPECT_EQ(site_.Observe(Sighting("a", kEntries, kEntries, {"cup"})).outcome,
            ObservationOutcome::kAccepted);
}

// The streams of several robots, each in order and with gaps of any length between them.
TEST_F(LateObservationsTest, AnyDelayOfAnyRobotShowsTheSame) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng rng(seed);
  const std::vector<std::string> labels = {"cup", "chair", "sofa", "bookcase"};
  std::vector<std::vector<Observation>> streams;
  FusedSite in_order;
  in_order.Start();
  streams.resize(4);
  for (int i = 0; i < 800; ++i) {
    const int robot = hypermap::testing::UniformInt(rng, 0, 3);
    const std::string name(1, static_cast<char>('d' + robot));
    streams[robot].push_back(
        Sighting(name, i, i, {labels[hypermap::testing::UniformInt(rng, 0, 3)]}));
    in_order.Observe(streams[robot].back());
  }
  FusedSite site;
  site.Start();
  std::vector<std::future<Verdicts>> verdicts;
  std::vector<size_t> next(streams.size(), 0);
  int robot = 0;
  for (int sent = 0; sent < 800;) {
    if (hypermap::testing::UniformInt(rng, 0, 30) == 0 || next[robot] == streams[robot].size()) {
      robot = hypermap::testing::UniformInt(rng, 0, 3);
      continue;
    }
    verdicts.push_back(site.Submit({streams[robot][next[robot]++]}));
    ++sent;
  }
  for (auto& verdict : verdicts) {
    const Verdicts answer = verdict.get();
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(answer->front().outcome, ObservationOutcome::kAccepted) << answer->front().message;
  }
  ExpectShowsTheSame(site, in_order);
}

}  // namespace
}  // namespace hypermap::server
