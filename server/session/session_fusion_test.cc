// Fused layers of a session: a layer shows the fold of its log, whatever the order of arrival.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "base/cancellation/cancellation.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "map/geometry/predicates.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "map/observations/view_frame.h"
#include "server/fusion/map_fusion.h"
#include "server/fusion/testing/tally_strategy.h"
#include "server/session/map_session.h"
#include "server/session/object_history.h"
#include "server/session/testing/fused_site.h"
#include "tests/support/random_map.h"

namespace hypermap::server {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

// `n` observations of the robots "a" and "b", ordered by stamp.
std::vector<Observation> TwoRobots(int n) {
  const std::vector<std::string> labels = {"cup", "chair", "sofa", "bookcase"};
  std::vector<Observation> observations;
  for (int i = 0; i < n; ++i) {
    std::vector<std::string> seen;
    for (size_t k = 0; k < labels.size(); ++k) {
      if ((i * 7 + k * 3) % 5 < 2) seen.push_back(labels[k]);
    }
    observations.push_back(Sighting(i % 3 == 0 ? "b" : "a", i, 0.5 * i, seen));
  }
  return observations;
}

TEST(MapFusionTest, ObservationIsOneRevisionWithItsObjectsAndItsExploredArea) {
  FusedSite site;
  site.Start();
  const Revision before = site.snapshot()->revision;
  const ObservationVerdict verdict = site.Observe(Sighting("a", 0, 0, {"cup", "chair"}));
  EXPECT_EQ(verdict.outcome, ObservationOutcome::kAccepted) << verdict.message;
  EXPECT_EQ(verdict.revision, before + 1);
  EXPECT_EQ(site.snapshot()->revision, before + 1);
  EXPECT_THAT(ObjectsOf(*site.snapshot()), SizeIs(2));
  EXPECT_THAT(ExploredCells(*site.snapshot()), SizeIs(16));
}

TEST(MapFusionTest, FoldsAreCounted) {
  FusedSite site;
  site.Start();
  site.Observe(Sighting("a", 0, 0, {"cup"}));
  site.Observe(Sighting("a", 2, 2, {"cup"}));
  EXPECT_EQ(site.session().meters().Read().fold_work.folded, 2);
  // A late one makes the fold begin again.
  site.Observe(Sighting("a", 1, 1, {"cup"}));
  EXPECT_EQ(site.session().meters().Read().fold_work.folded, 5);
  EXPECT_GT(site.session().meters().Read().fold_work.cpu, absl::ZeroDuration());
}

// Folds observations together, one of each author, and returns the author of their revision.
std::string AuthorOfAll(const std::vector<std::string>& authors) {
  FusedSite site;
  site.Start();
  site.disk().Hold();
  auto held = site.Submit({Sighting("a", 0, 0, {"cup"})});
  site.disk().AwaitHeldWrite();
  std::vector<std::future<Verdicts>> answers;
  for (size_t i = 0; i < authors.size(); ++i) {
    const auto sequence = static_cast<int64_t>(i) + 1;
    const Observation seen = Sighting("a", sequence, static_cast<double>(sequence), {"cup"});
    answers.push_back(site.Submit(ObservationSubmission{"things", {seen}, authors[i]}));
  }
  site.disk().Release();
  const Verdicts first = held.get();
  EXPECT_TRUE(first.ok()) << first.status();
  for (std::future<Verdicts>& answer : answers) {
    const Verdicts verdicts = answer.get();
    EXPECT_TRUE(verdicts.ok()) << verdicts.status();
    EXPECT_EQ(verdicts->front().outcome, ObservationOutcome::kAccepted);
    EXPECT_EQ(verdicts->front().revision, first->front().revision + 1) << "not folded together";
  }
  return site.Author();
}

TEST(MapFusionTest, RevisionOfManyAuthorsNamesSomeOfThem) {
  EXPECT_EQ(AuthorOfAll({"bob", "ann", "bob"}), "ann, bob");
  std::vector<std::string> authors;
  for (char c = 'a'; c <= 'j'; ++c) authors.emplace_back(1, c);
  EXPECT_EQ(AuthorOfAll(authors), "a, b, c, d, e, f, g, h, i, j");
  authors.insert(authors.end(), {"k", "l"});
  EXPECT_EQ(AuthorOfAll(authors), "a, b, c, d, e, f, g, h, i, j, and 2 more");
  // Long names are fewer.
  for (std::string& author : authors) author.resize(FixedLimits::kMaxAuthorLength, 'x');
  const std::string author = AuthorOfAll(authors);
  EXPECT_EQ(author, authors[0] + ", " + authors[1] + ", " + authors[2] + ", and 9 more");
}

TEST(MapFusionTest, ObservationsWhoseCallerHasGoneAreNotCarriedOut) {
  FusedSite site;
  site.Start();
  site.disk().Hold();
  auto held = site.Submit({Sighting("a", 0, 0, {"cup"})});
  site.disk().AwaitHeldWrite();
  bool is_gone = false;
  int looks = 0;
  const auto submit = [&](const Observation& observation) {
    ObservationSubmission submission{"things", {observation}, "test"};
    submission.cancellation = std::make_shared<Cancellation>(
        [&] {
          ++looks;
          return is_gone ? absl::CancelledError("gone") : absl::OkStatus();
        },
        absl::ZeroDuration());
    return site.Submit(std::move(submission));
  };
  auto before = site.Submit({Sighting("a", 1, 1, {"chair"})});
  auto dropped = submit(Sighting("a", 2, 2, {"sofa"}));
  auto after = site.Submit({Sighting("a", 3, 3, {"bookcase"})});
  is_gone = true;
  site.disk().Release();
  EXPECT_TRUE(held.get().ok());
  EXPECT_TRUE(absl::IsCancelled(dropped.get().status()));
  // The others are folded together, as if it had not been sent.
  const Verdicts one = before.get();
  const Verdicts other = after.get();
  ASSERT_TRUE(one.ok() && other.ok()) << one.status() << other.status();
  EXPECT_EQ(one->front().revision, other->front().revision);
  EXPECT_EQ(looks, 1);
  EXPECT_EQ(site.Find("sofa"), nullptr);
  EXPECT_NE(site.Find("chair"), nullptr);
  EXPECT_NE(site.Find("bookcase"), nullptr);
  // It can be sent again.
  is_gone = false;
  const Verdicts again = submit(Sighting("a", 2, 2, {"sofa"})).get();
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->front().outcome, ObservationOutcome::kAccepted);
}

TEST(MapFusionTest, ObservationsThatWereAdmittedStayWhenTheirCallerGoes) {
  FusedSite site;
  site.Start();
  site.disk().Hold();
  auto held = site.Submit({Sighting("a", 0, 0, {"cup"})});
  site.disk().AwaitHeldWrite();
  // The caller goes after the first look, when its observation is admitted.
  int looks = 0;
  ObservationSubmission submission{"things", {Sighting("a", 1, 1, {"sofa"})}, "test"};
  submission.cancellation = std::make_shared<Cancellation>(
      [&] { return ++looks == 1 ? absl::OkStatus() : absl::CancelledError("gone"); },
      absl::ZeroDuration());
  auto admitted = site.Submit(std::move(submission));
  auto other = site.Submit({Sighting("a", 2, 2, {"chair"})});
  site.disk().Release();
  EXPECT_TRUE(held.get().ok());
  const Verdicts verdicts = admitted.get();
  ASSERT_TRUE(verdicts.ok()) << verdicts.status();
  EXPECT_EQ(verdicts->front().outcome, ObservationOutcome::kAccepted);
  EXPECT_TRUE(other.get().ok());
  EXPECT_NE(site.Find("sofa"), nullptr);
}

TEST(MapFusionTest, EachObservationCountsOnceWhateverIsSentAgain) {
  FusedSite site;
  site.Start();
  const Observation first = Sighting("a", 0, 0, {"cup"});
  site.Observe(first);
  const SnapshotPtr before = site.snapshot();
  const ObservationVerdict again = site.Observe(first);
  EXPECT_EQ(again.outcome, ObservationOutcome::kDuplicate);
  EXPECT_EQ(again.revision, before->revision);
  const ObservationVerdict other = site.Observe(Sighting("a", 0, 0, {"sofa"}));
  EXPECT_EQ(other.outcome, ObservationOutcome::kConflict);
  EXPECT_EQ(site.snapshot(), before);
  // Duplicates are also found within one submission, and after a restart.
  const Observation next = Sighting("a", 1, 1, {"cup"});
  const Verdicts twice = site.Submit({next, next}).get();
  EXPECT_EQ((*twice)[0].outcome, ObservationOutcome::kAccepted);
  EXPECT_EQ((*twice)[1].outcome, ObservationOutcome::kDuplicate);
  site.Restart();
  EXPECT_EQ(site.Observe(next).outcome, ObservationOutcome::kDuplicate);
}

TEST(MapFusionTest, C2RobotIsLateAgainstItsOwnStreamOnly) {
  FusedSite site;
  FusedSite in_order;
  for (FusedSite* s : {&site, &in_order}) s->Start();
  const Observation ahead = Sighting("rogue", 0, 1000, {"cup"});
  const std::vector<Observation> honest = {
      Sighting("a", 0, 0, {"chair"}), Sighting("a", 1, 10, {"chair"}),
      Sighting("b", 0, 401, {"sofa"}), Sighting("a", 2, 601, {"cup"})};
  EXPECT_EQ(site.Observe(ahead).outcome, ObservationOutcome::kAccepted);
  for (const Observation& observation : honest) {
    const ObservationVerdict verdict = site.Observe(observation);
    EXPECT_EQ(verdict.outcome, ObservationOutcome::kAccepted) << verdict.message;
  }
  // The newest of the robot counts, also after a restart.
  EXPECT_EQ(site.Observe(Sighting("a", 3, 0.5, {"cup"})).outcome, ObservationOutcome::kRefusedLate);
  site.Restart();
  EXPECT_EQ(site.Observe(Sighting("a", 4, 0.5, {"cup"})).outcome, ObservationOutcome::kRefusedLate);
  EXPECT_EQ(site.Observe(Sighting("rogue", 1, 399, {"cup"})).outcome,
            ObservationOutcome::kRefusedLate);
  EXPECT_EQ(site.Observe(Sighting("b", 1, 0, {"cup"})).outcome, ObservationOutcome::kAccepted);
  // The layer shows the fold of what was accepted, in whatever order it came.
  in_order.Observe(Sighting("b", 1, 0, {"cup"}));
  for (const Observation& observation : honest) in_order.Observe(observation);
  in_order.Observe(ahead);
  ExpectShowsTheSame(site, in_order);
}

TEST(MapFusionTest, C2SkewOfARobotsClockIsTold) {
  FusedSite site;
  absl::Time now = kBegin + absl::Minutes(10);
  site.options().fusion.clock = [&now] { return now; };
  site.Restart();
  site.Start();
  const auto skew_s = [&](const Observation& observation) {
    return site.Observe(observation).clock_skew_s;
  };
  EXPECT_EQ(skew_s(Sighting("rogue", 0, 1198, {"cup"})), 598.0);
  EXPECT_EQ(skew_s(Sighting("cart", 0, 599.5, {"cup"})), -0.5);
  // An observation that took longer on its way tells less than a quick one.
  EXPECT_EQ(skew_s(Sighting("cart", 1, 590, {"cup"})), -0.5);
  now += absl::Seconds(1);
  EXPECT_EQ(skew_s(Sighting("cart", 2, 600.75, {"cup"})), -0.25);
  // A robot whose clock is too far ahead is told so, too.
  const ObservationVerdict refused = site.Observe(Sighting("lost", 0, 3600, {"cup"}));
  EXPECT_EQ(refused.outcome, ObservationOutcome::kInvalid);
  EXPECT_THAT(refused.message, HasSubstr("ahead of the server's clock"));
  EXPECT_EQ(refused.clock_skew_s, 2999.0);
  // A retry tells nothing, and neither does a message that is not valid.
  EXPECT_EQ(skew_s(Sighting("cart", 2, 600.75, {"cup"})), std::nullopt);
  Observation bad = Sighting("cart", 3, 601, {"cup"});
  bad.detections[0].weight = 2.0;
  EXPECT_EQ(skew_s(bad), std::nullopt);
  const auto robots = site.session().ReadRobotClocks();
  ASSERT_TRUE(robots.ok()) << robots.status();
  ASSERT_THAT(*robots, SizeIs(3));
  EXPECT_EQ((*robots)[0].name, "lost");
  EXPECT_EQ((*robots)[1].name, "cart");
  EXPECT_EQ((*robots)[1].skew, -absl::Milliseconds(250));
  EXPECT_EQ((*robots)[2].skew, absl::Seconds(598));
  // Frames of the rogue that are as far ahead make nobody else late.
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(site.Observe(Sighting("rogue", 1 + i, 1190 + i, {"cup"})).outcome,
              ObservationOutcome::kAccepted);
    EXPECT_EQ(site.Observe(Sighting("cart", 10 + i, 600 + i, {"cup"})).outcome,
              ObservationOutcome::kAccepted);
  }
  // When its clock has been corrected, its frames are not late against the server's clock.
  now += absl::Minutes(1);
  EXPECT_EQ(site.Observe(Sighting("rogue", 9, 61, {"cup"})).outcome, ObservationOutcome::kAccepted);
  EXPECT_EQ(site.Observe(Sighting("rogue", 10, 60, {"cup"})).outcome,
            ObservationOutcome::kRefusedLate);
}

TEST(MapFusionTest, C2RetractedObservationsMakeNoneLate) {
  FusedSite site;
  site.Start();
  site.Observe(Sighting("a", 0, 0, {"cup"}));
  site.Observe(Sighting("a", 1, 2000, {"cup"}));
  EXPECT_EQ(site.Observe(Sighting("a", 2, 10, {"cup"})).outcome, ObservationOutcome::kRefusedLate);
  ASSERT_TRUE(site.Run(RetractObservations{"things", "a", kBegin + absl::Seconds(1)}).ok());
  EXPECT_EQ(site.Observe(Sighting("a", 3, 10, {"cup"})).outcome, ObservationOutcome::kAccepted);
  // Also in the commit of the retraction, which is not stored yet.
  site.Observe(Sighting("a", 4, 2000, {"cup"}));
  site.disk().Hold();
  auto held = site.Submit({Sighting("b", 0, 0, {"cup"})});
  site.disk().AwaitHeldWrite();
  std::promise<bool> retracted;
  site.session().Run(
      FusionSubmission{RetractObservations{"things", "a", kBegin + absl::Seconds(1000)}, "test",
                       ""},
      [&](const absl::StatusOr<storage::Receipt>& receipt) { retracted.set_value(receipt.ok()); });
  auto late = site.Submit({Sighting("a", 5, 20, {"cup"}), Sighting("a", 6, 700, {"cup"}),
                           Sighting("a", 7, 99, {"cup"})});
  site.disk().Release();
  EXPECT_TRUE(retracted.get_future().get());
  const Verdicts verdicts = late.get();
  ASSERT_TRUE(verdicts.ok()) << verdicts.status();
  EXPECT_EQ((*verdicts)[0].outcome, ObservationOutcome::kAccepted) << (*verdicts)[0].message;
  EXPECT_EQ((*verdicts)[1].outcome, ObservationOutcome::kAccepted);
  EXPECT_EQ((*verdicts)[2].outcome, ObservationOutcome::kRefusedLate);
}

TEST(MapFusionTest, LateOnesAreRefusedByTheRuleAndBadOnesNameTheField) {
  FusedSite site;
  site.Start();
  site.Observe(Sighting("b", 0, 1000, {"cup"}));
  EXPECT_EQ(site.Observe(Sighting("b", 1, 399.9, {"cup"})).outcome,
            ObservationOutcome::kRefusedLate);
  EXPECT_EQ(site.Observe(Sighting("b", 2, 400, {"cup"})).outcome, ObservationOutcome::kAccepted);
  Observation bad = Sighting("b", 3, 1000, {"cup"});
  bad.detections[0].weight = 2.0;
  const ObservationVerdict verdict = site.Observe(bad);
  EXPECT_EQ(verdict.outcome, ObservationOutcome::kInvalid);
  EXPECT_THAT(verdict.message, HasSubstr("detections[0].weight"));
  Observation lost = Sighting("b", 4, 1000, {"cup"});
  lost.frame_id = "nowhere";
  EXPECT_THAT(site.Observe(lost).message, HasSubstr("nowhere"));
  Observation future = Sighting("b", 5, 0, {"cup"});
  future.stamp = absl::Now() + absl::Hours(1);
  EXPECT_THAT(site.Observe(future).message, HasSubstr("ahead of the server's clock"));
  Observation vast = Sighting("b", 6, 1000, {});
  vast.free_space = Polygon::FromBox({{0, 0}, {1e8, 1}});
  EXPECT_THAT(site.Observe(vast).message, HasSubstr("free_space"));
  EXPECT_THAT(ObjectsOf(*site.snapshot()), SizeIs(1));
}

TEST(MapFusionTest, LayerThatIsNotFusedTakesNoObservations) {
  FusedSite site;
  EXPECT_TRUE(absl::IsFailedPrecondition(site.Submit({Sighting("a", 0, 0, {})}).get().status()));
  EXPECT_TRUE(absl::IsNotFound(site.Run(StartFusion{"nowhere", {}}).status()));
  EXPECT_TRUE(absl::IsFailedPrecondition(site.Run(StartFusion{"seen", {}}).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(site.Run(StartFusion{"things", {"none", "", ""}}).status()));
  EXPECT_TRUE(absl::IsNotFound(site.Run(StartFusion{"things", {"", "", "nowhere"}}).status()));
  site.Start();
  const Revision revision = site.snapshot()->revision;
  site.Start("tally");
  EXPECT_EQ(site.snapshot()->revision, revision);
  EXPECT_TRUE(
      absl::IsFailedPrecondition(site.Run(StartFusion{"things", {"other", "", ""}}).status()));
}

TEST(MapFusionTest, LayerThatTakesNoPolygonsIsNotFused) {
  FusedSite site;
  LayerSpec spec;
  spec.name = "lanes";
  spec.kind = LayerKind::kSemantic;
  spec.shape_kinds = ShapeKinds({ShapeKind::kLineString, ShapeKind::kPoint});
  EditBatch batch;
  batch.edits = {CreateLayer{spec}};
  ASSERT_TRUE(site.Edit(batch).ok());
  const absl::Status status = site.Run(StartFusion{"lanes", {}}).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("\"lanes\" takes no polygons"));
}

TEST(MapFusionTest, FailedAllocationIsAnErrorAndChangesNothing) {
  FusedSite site;
  site.Start();
  site.Observe(Sighting("a", 0, 0, {"cup"}));
  const Revision revision = site.snapshot()->revision;
  const absl::Status failed =
      site.Submit({Sighting("a", 1, 1, {TallyStrategy::kNoMemory})}).get().status();
  EXPECT_TRUE(absl::IsResourceExhausted(failed)) << failed;
  EXPECT_EQ(site.snapshot()->revision, revision);
  EXPECT_EQ(site.Observe(Sighting("a", 1, 1, {"bowl"})).outcome, ObservationOutcome::kAccepted);
  EXPECT_THAT(ObjectsOf(*site.snapshot()), SizeIs(2));
}

TEST(MapFusionTest, AnyOrderOfArrivalWithRestartsShowsTheSame) {
  const std::vector<Observation> log = TwoRobots(120);
  FusedSite in_order;
  in_order.Start();
  for (const Observation& observation : log) in_order.Observe(observation);

  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng rng(seed);
  for (int round = 0; round < 10; ++round) {
    std::vector<Observation> shuffled = log;
    // Even rounds: observations come a little late. Odd rounds: as late as can be.
    for (size_t i = 1; i < shuffled.size(); ++i) {
      const int back = hypermap::testing::UniformInt(rng, 0, round % 2 == 0 ? 6 : 119);
      std::swap(shuffled[i], shuffled[std::max<int>(0, static_cast<int>(i) - back)]);
    }
    FusedSite site;
    site.Start();
    std::vector<std::future<Verdicts>> verdicts;
    for (size_t i = 0; i < shuffled.size();) {
      const size_t n =
          std::min<size_t>(hypermap::testing::UniformInt(rng, 1, 5), shuffled.size() - i);
      verdicts.push_back(site.Submit({shuffled.begin() + i, shuffled.begin() + i + n}));
      i += n;
      if (hypermap::testing::UniformInt(rng, 0, 9) == 0) {
        // A session that ends refuses late observations that wait.
        for (auto& verdict : verdicts) verdict.wait();
        site.Restart();
      }
    }
    for (auto& verdict : verdicts) {
      const Verdicts answer = verdict.get();
      ASSERT_TRUE(answer.ok()) << answer.status();
      for (const ObservationVerdict& v : *answer) {
        EXPECT_EQ(v.outcome, ObservationOutcome::kAccepted) << v.message;
      }
    }
    ExpectShowsTheSame(site, in_order);
  }
}

TEST(MapFusionTest, ObservationsThatQueueBecomeOneRevisionAndOneWrite) {
  FusedSite site;
  site.Start();
  site.disk().Hold();
  auto held = site.Submit({Sighting("a", 0, 0, {"cup"})});
  site.disk().AwaitHeldWrite();
  std::vector<std::future<Verdicts>> queued;
  for (int i = 1; i < 20; ++i) queued.push_back(site.Submit({Sighting("a", i, 20 - i, {"cup"})}));
  site.disk().Release();
  const Revision first = held.get()->front().revision;
  for (auto& verdicts : queued) EXPECT_EQ(verdicts.get()->front().revision, first + 1);
}

TEST(MapFusionTest, RestartChangesNothingAndGoesOn) {
  const std::vector<Observation> log = TwoRobots(60);
  FusedSite site;
  FusedSite oracle;
  for (FusedSite* s : {&site, &oracle}) s->Start();
  for (size_t i = 0; i < log.size(); ++i) {
    if (i % 7 == 0) {
      const SnapshotPtr before = site.snapshot();
      site.Restart();
      EXPECT_EQ(site.snapshot(), before);
    }
    site.Observe(log[i]);
    oracle.Observe(log[i]);
  }
  ExpectShowsTheSame(site, oracle);
  EXPECT_EQ(site.snapshot()->revision, oracle.snapshot()->revision);
  EXPECT_EQ(site.Find("cup")->id, oracle.Find("cup")->id);
}

TEST(MapFusionTest, RetractedSourceIsAsIfItHadNeverBeen) {
  FusedSite site;
  FusedSite without;
  for (FusedSite* s : {&site, &without}) s->Start();
  for (const Observation& observation : TwoRobots(60)) {
    site.Observe(observation);
    if (observation.robot != "b") without.Observe(observation);
  }
  const auto retracted = site.Run(RetractObservations{"things", "b"}, "r1");
  ASSERT_TRUE(retracted.ok()) << retracted.status();
  ExpectShowsTheSame(site, without);
  // The same request changes nothing more; a new one finds nothing.
  EXPECT_EQ(site.Run(RetractObservations{"things", "b"}, "r1")->revision, retracted->revision);
  EXPECT_TRUE(absl::IsNotFound(site.Run(RetractObservations{"things", "b"}, "r2").status()));
  // A retracted observation is not accepted again.
  EXPECT_EQ(site.Observe(TwoRobots(1)[0]).outcome, ObservationOutcome::kDuplicate);
  site.Restart();
  ExpectShowsTheSame(site, without);
  site.Observe(Sighting("a", 200, 40, {"cup"}));
  without.Observe(Sighting("a", 200, 40, {"cup"}));
  ExpectShowsTheSame(site, without);
}

TEST(MapFusionTest, RetractingATimeTakesOnlyThatTime) {
  FusedSite site;
  FusedSite without;
  for (FusedSite* s : {&site, &without}) s->Start();
  const auto from = kBegin + absl::Seconds(10);
  const auto to = kBegin + absl::Seconds(20);
  for (const Observation& observation : TwoRobots(60)) {
    site.Observe(observation);
    const bool taken =
        observation.robot == "a" && observation.stamp >= from && observation.stamp < to;
    if (!taken) without.Observe(observation);
  }
  ASSERT_TRUE(site.Run(RetractObservations{"things", "a", from, to}).ok());
  ExpectShowsTheSame(site, without);
}

TEST(MapFusionTest, CorrectedObservationsAreAsIfTheirPosesHadBeenClaimed) {
  FusedSite site;
  FusedSite claimed;
  for (FusedSite* s : {&site, &claimed}) s->Start();
  const auto drift = [](absl::Time stamp) {
    const double t = absl::ToDoubleSeconds(stamp - kBegin);
    return CorrectedPose{stamp, PlanarTransform(0.25 * t, -0.5, 0.01 * t)};
  };
  PoseCorrection rough{"b", {}};
  PoseCorrection good{"b", {}};
  for (const Observation& observation : TwoRobots(60)) {
    site.Observe(observation);
    good.poses.push_back(drift(observation.stamp));
    rough.poses.push_back({observation.stamp, PlanarTransform(9.0, 9.0, 3.0)});
    claimed.Observe(observation.robot == "b" ? *WithPose(observation, good.poses.back())
                                             : observation);
  }
  const ObjectId cup = site.Find("cup")->id;
  ASSERT_TRUE(site.Run(CorrectPoses{"things", "", {rough}}).ok());
  const auto corrected = site.Run(CorrectPoses{"things", "", {good}}, "r1");
  ASSERT_TRUE(corrected.ok()) << corrected.status();
  ExpectShowsTheSame(site, claimed);
  EXPECT_EQ(site.Find("cup")->id, cup);
  // The same request changes nothing more.
  EXPECT_EQ(site.Run(CorrectPoses{"things", "", {good}}, "r1")->revision, corrected->revision);
  site.Restart();
  ExpectShowsTheSame(site, claimed);
  // Facts and later observations come after the correction; a late one is corrected, too.
  Observation late = Sighting("b", 500, 28.75, {"cup", "plate"});
  late.pose.frame_from_camera.translation() = Eigen::Vector3d(3.0, 0.0, 0.0);
  EXPECT_EQ(site.Observe(late).outcome, ObservationOutcome::kAccepted);
  claimed.Observe(*WithPose(late, *PoseAt(good.poses, late.stamp)));
  ExpectShowsTheSame(site, claimed);
  for (FusedSite* s : {&site, &claimed}) s->Observe(Sighting("b", 501, 100, {"cup"}));
  ExpectShowsTheSame(site, claimed);
  ASSERT_TRUE(site.Run(RebuildFusion{"things", "", ""}).ok());
  ExpectShowsTheSame(site, claimed);
}

TEST(MapFusionTest, CorrectedViewsAreThoseThatClaimedThePoses) {
  FusedSite site;
  FusedSite claimed;
  for (FusedSite* s : {&site, &claimed}) s->Start();
  PoseCorrection good{"b", {}};
  // Two robots that stand elsewhere from frame to frame than they say, and see the same things.
  const auto send = [&](Observation view) {
    const double t = absl::ToDoubleSeconds(view.stamp - kBegin);
    const CorrectedPose truth{view.stamp, PlanarTransform(t / 7.0, -1.0 / 3.0, t / 90.0),
                              1e-4 * Eigen::Matrix3d::Identity()};
    view.pose = {ViewFromCamera(-Eigen::Vector3d::UnitY(), 1.0),
                 1e-2 * Eigen::Matrix3d::Identity()};
    view.frame_from_view = PlanarTransform(t / 7.0 + 0.1 * std::sin(t), -0.3, t / 90.0 + 0.01);
    site.Observe(view);
    if (view.robot == "b") {
      good.poses.push_back(truth);
      view.frame_from_view = truth.frame_from_view;
      view.pose.covariance = truth.covariance;
    }
    return claimed.Observe(view).outcome;
  };
  for (const Observation& observation : TwoRobots(60)) {
    ASSERT_EQ(send(observation), ObservationOutcome::kAccepted);
  }
  EXPECT_NE(ObjectsOf(*site.snapshot()), ObjectsOf(*claimed.snapshot()));
  ASSERT_TRUE(site.Run(CorrectPoses{"things", "", {good}}).ok());
  ExpectShowsTheSame(site, claimed);
  site.Restart();
  ASSERT_TRUE(site.Run(RebuildFusion{"things", "", ""}).ok());
  ExpectShowsTheSame(site, claimed);
  // Where the things were seen.
  ASSERT_NE(site.Find("cup"), nullptr);
  EXPECT_GT(Centroid(site.Find("cup")->shape.polygon()).x, 6.0);
}

TEST(MapFusionTest, PosesThatCorrectNothingAreRefused) {
  FusedSite site;
  site.Start();
  site.Observe(Sighting("a", 1, 10, {"cup"}));
  const CorrectedPose at{kBegin + absl::Seconds(10), PlanarTransform(1.0, 0.0, 0.0)};
  CorrectedPose before = at;
  before.stamp -= absl::Seconds(1);
  CorrectedPose after = at;
  after.stamp += absl::Seconds(1);
  const Revision revision = site.snapshot()->revision;
  const auto correct = [&](const std::string& robot, std::vector<CorrectedPose> poses) {
    return site.Run(CorrectPoses{"things", "", {{robot, std::move(poses)}}}).status();
  };
  EXPECT_TRUE(absl::IsNotFound(correct("b", {at})));
  EXPECT_TRUE(absl::IsNotFound(correct("a", {before, after})));  // A gap.
  EXPECT_TRUE(absl::IsInvalidArgument(correct("a", {})));
  EXPECT_TRUE(absl::IsInvalidArgument(correct("a", {after, before})));
  EXPECT_TRUE(
      absl::IsNotFound(site.Run(CorrectPoses{"things", "nowhere", {{"a", {at}}}}).status()));
  EXPECT_EQ(site.snapshot()->revision, revision);
  EXPECT_TRUE(correct("a", {at}).ok());
  EXPECT_EQ(site.snapshot()->revision, revision + 1);
}

TEST(MapFusionTest, RebuiltLayerIsAsIfFusedSoFromTheStartAndKeepsItsIds) {
  FusedSite site;
  FusedSite other;
  site.Start("tally");
  other.Start("other");
  for (const Observation& observation : TwoRobots(60)) {
    site.Observe(observation);
    other.Observe(observation);
  }
  const ObjectId cup = site.Find("cup")->id;
  const Revision before = site.snapshot()->revision;
  const auto rebuilt = site.Run(RebuildFusion{"things", "other", ""});
  ASSERT_TRUE(rebuilt.ok()) << rebuilt.status();
  EXPECT_EQ(rebuilt->revision, before + 1);
  ExpectShowsTheSame(site, other);
  EXPECT_EQ(site.Find("cup")->id, cup);
  site.Restart();
  site.Observe(Sighting("a", 100, 30, {"cup"}));
  other.Observe(Sighting("a", 100, 30, {"cup"}));
  ExpectShowsTheSame(site, other);
  EXPECT_TRUE(absl::IsInvalidArgument(site.Run(RebuildFusion{"things", "none", ""}).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(site.Run(RebuildFusion{"things", "", "{\"a\":1}"}).status()));
  ExpectShowsTheSame(site, other);
}

// A command is given up wherever its caller leaves, and then nothing has changed.
void ExpectGivenUp(FusedSite& site, const FusionCommand& command) {
  const Revision before = site.snapshot()->revision;
  const std::vector<SemanticObject> objects = ObjectsOf(*site.snapshot());
  {
    CancelledAfter cancelled(20);
    EXPECT_TRUE(absl::IsCancelled(site.Run(command).status()));
  }
  EXPECT_EQ(site.snapshot()->revision, before);
  EXPECT_EQ(ObjectsOf(*site.snapshot()), objects);
  // The last run is not cancelled.
  EXPECT_GT(TimesCancelled([&] { return site.Run(command).status(); }), 5);
  EXPECT_EQ(site.snapshot()->revision, before + 1);
}

TEST(MapFusionTest, A5_RebuildThatIsGivenUpChangesNothing) {
  FusedSite site;
  FusedSite other;
  site.Start("tally");
  other.Start("other");
  for (const Observation& observation : TwoRobots(60)) {
    site.Observe(observation);
    other.Observe(observation);
  }
  ExpectGivenUp(site, RebuildFusion{"things", "other", ""});
  ExpectShowsTheSame(site, other);
  site.Restart();
  for (FusedSite* s : {&site, &other}) s->Observe(Sighting("a", 100, 30, {"cup"}));
  ExpectShowsTheSame(site, other);
}

TEST(MapFusionTest, A5_RetractionThatIsGivenUpChangesNothing) {
  FusedSite site;
  FusedSite without;
  for (FusedSite* s : {&site, &without}) s->Start();
  for (const Observation& observation : TwoRobots(60)) {
    site.Observe(observation);
    if (observation.robot != "b") without.Observe(observation);
  }
  ExpectGivenUp(site, RetractObservations{"things", "b"});
  ExpectShowsTheSame(site, without);
  site.Restart();
  for (FusedSite* s : {&site, &without}) s->Observe(Sighting("a", 200, 40, {"cup"}));
  ExpectShowsTheSame(site, without);
}

TEST(MapFusionTest, A5_GivenUpRebuildCostsTheRestOfItsGroupNothing) {
  FusedSite site;
  site.Start();
  for (const Observation& observation : TwoRobots(20)) site.Observe(observation);
  // Both wait while the writer is held, so that they become one group.
  site.disk().Hold();
  auto held = site.Submit({Sighting("c", 0, 5, {"lamp"})});
  site.disk().AwaitHeldWrite();
  auto before = site.Submit({Sighting("c", 1, 6, {"lamp"})});
  int64_t looks = 5;
  FusionSubmission rebuild{RebuildFusion{"things", "other", ""}, "test", ""};
  rebuild.cancellation = std::make_shared<Cancellation>(
      [&looks] { return looks-- > 0 ? absl::OkStatus() : absl::CancelledError("gone"); },
      absl::ZeroDuration());
  std::promise<absl::Status> answer;
  site.session().Run(std::move(rebuild), [&answer](absl::StatusOr<storage::Receipt> receipt) {
    answer.set_value(receipt.status());
  });
  auto after = site.Submit({Sighting("c", 2, 7, {"lamp"})});
  site.disk().Release();
  EXPECT_TRUE(absl::IsCancelled(answer.get_future().get()));
  for (auto* verdicts : {&held, &before, &after}) {
    const Verdicts got = verdicts->get();
    ASSERT_TRUE(got.ok()) << got.status();
    EXPECT_EQ(got->front().outcome, ObservationOutcome::kAccepted);
  }
  EXPECT_NE(site.Find("lamp"), nullptr);
}

TEST(MapFusionTest, A5_LoadingALayerIsGivenUpAndBeginsAnewForTheNext) {
  FusedSite site;
  site.Start();
  for (const Observation& observation : TwoRobots(40)) site.Observe(observation);
  const ObjectId cup = site.Find("cup")->id;
  const auto explain = [&site, cup] {
    return ExplainObject(site.session(), "things", cup, [] { return absl::OkStatus(); });
  };
  const auto expected = explain();
  ASSERT_TRUE(expected.ok()) << expected.status();
  site.Restart();
  EXPECT_GT(TimesCancelled([&] { return explain().status(); }), 5);
  EXPECT_EQ(explain()->events.size(), expected->events.size());
}

SemanticObject Box(ObjectId id, const std::string& label, double x) {
  SemanticObject object;
  object.id = id;
  object.label = label;
  object.shape = Polygon::FromBox({{x, 5}, {x + 1, 6}});
  return object;
}

TEST(MapFusionTest, WhatAnOperatorPutsStaysWhateverIsSeen) {
  FusedSite site;
  site.Start();
  site.Observe(Sighting("a", 0, 10, {"cup", "sofa"}));
  const ObjectId cup = site.Find("cup")->id;
  ASSERT_TRUE(site.Edit({{PutObject{"things", Box(cup, "mug", 3), ""}}}).ok());
  const auto lamp = site.Edit({{PutObject{"things", Box(0, "lamp", 8), ""}}});
  ASSERT_TRUE(lamp.ok()) << lamp.status();
  ASSERT_THAT(lamp->object_ids, SizeIs(1));
  site.Restart();
  site.Observe(Sighting("a", 1, 11, {"sofa", "lamp", "mug"}));
  // A late observation, for which the log is folded again.
  site.Observe(Sighting("a", 2, 5, {"sofa"}));
  EXPECT_EQ(*site.Find("mug"), Box(cup, "mug", 3));
  EXPECT_EQ(*site.Find("lamp"), Box(lamp->object_ids[0], "lamp", 8));
  EXPECT_EQ(site.Find("cup"), nullptr);
  EXPECT_THAT(ObjectsOf(*site.snapshot()), SizeIs(3));
}

TEST(MapFusionTest, ObjectPutOnATrackTakesItOverUnderItsOwnId) {
  FusedSite site;
  site.Start();
  site.Observe(Sighting("a", 0, 10, {"cup"}));
  const auto put = site.Edit({{PutObject{"things", Box(0, "cup", 8), ""}}});
  ASSERT_TRUE(put.ok()) << put.status();
  EXPECT_THAT(ObjectsOf(*site.snapshot()), SizeIs(1));
  EXPECT_EQ(*site.Find("cup"), Box(put->object_ids[0], "cup", 8));
  site.Restart();
  site.Observe(Sighting("a", 1, 11, {"cup", "sofa"}));
  site.Observe(Sighting("a", 2, 9, {"cup"}));
  EXPECT_THAT(ObjectsOf(*site.snapshot()), SizeIs(2));
  EXPECT_EQ(*site.Find("cup"), Box(put->object_ids[0], "cup", 8));
}

TEST(MapFusionTest, WhatAnOperatorDeletesStaysAway) {
  FusedSite site;
  site.Start();
  site.Observe(Sighting("a", 0, 10, {"cup", "sofa"}));
  ASSERT_TRUE(site.Edit({{DeleteObject{"things", site.Find("cup")->id}}}).ok());
  EXPECT_EQ(site.Find("cup"), nullptr);
  site.Observe(Sighting("a", 1, 11, {"cup"}));
  site.Restart();
  site.Observe(Sighting("a", 2, 5, {"cup"}));
  EXPECT_EQ(site.Find("cup"), nullptr);
  EXPECT_THAT(ObjectsOf(*site.snapshot()), SizeIs(1));
}

TEST(MapFusionTest, ObjectsFromBeforeFusionAreLeftAlone) {
  FusedSite site;
  ASSERT_TRUE(site.Edit({{PutObject{"things", Box(0, "wardrobe", 8), ""}}}).ok());
  const ObjectPtr wardrobe = site.Find("wardrobe");
  site.Start();
  site.Observe(Sighting("a", 0, 10, {"cup"}));
  site.Observe(Sighting("a", 1, 9, {"cup"}));
  ASSERT_TRUE(site.Run(RebuildFusion{"things", "other", ""}).ok());
  ASSERT_TRUE(site.Run(RetractObservations{"things", "a"}).ok());
  EXPECT_EQ(*site.Find("wardrobe"), *wardrobe);
  EXPECT_THAT(ObjectsOf(*site.snapshot()), SizeIs(1));
}

TEST(MapFusionTest, FailedWriteAcknowledgesNothingAndLeavesAllAsItWas) {
  FusedSite site;
  FusedSite oracle;
  for (FusedSite* s : {&site, &oracle}) s->Start();
  const std::vector<Observation> log = TwoRobots(30);
  for (size_t i = 0; i < log.size(); ++i) {
    if (i % 5 == 3) {
      const SnapshotPtr before = site.snapshot();
      site.disk().FailWrites(absl::ResourceExhaustedError("disk full"));
      EXPECT_TRUE(absl::IsResourceExhausted(site.Submit({log[i]}).get().status()));
      site.disk().FailWrites(absl::OkStatus());
      EXPECT_EQ(site.snapshot(), before);
    }
    EXPECT_EQ(site.Observe(log[i]).outcome, ObservationOutcome::kAccepted);
    oracle.Observe(log[i]);
  }
  ExpectShowsTheSame(site, oracle);
}

TEST(MapFusionTest, DeletedLayerTakesItsLogWithIt) {
  FusedSite site;
  site.Start();
  site.Observe(Sighting("a", 0, 10, {"cup"}));
  LayerSpec things;
  things.name = "things";
  ASSERT_TRUE(site.Edit({{DeleteLayer{"things"}, CreateLayer{things}}}).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(site.Submit({Sighting("a", 1, 11, {})}).get().status()));
  site.Start("other");
  EXPECT_EQ(site.Observe(Sighting("a", 0, 10, {"sofa"})).outcome, ObservationOutcome::kAccepted);
  EXPECT_THAT(ObjectsOf(*site.snapshot()), SizeIs(1));
}

TEST(MapFusionTest, ObservationsInAnotherFrameAreFusedInTheLayersOwn) {
  FusedSite site;
  ASSERT_TRUE(site.Edit({{SetTransform{{"map", "dock", PlanarTransform(10, 20, 0)}}}}).ok());
  site.Start();
  Observation observation = Sighting("a", 0, 0, {"cup"});
  observation.frame_id = "dock";
  EXPECT_EQ(site.Observe(observation).outcome, ObservationOutcome::kAccepted);
  EXPECT_EQ(site.Find("cup")->shape, Polygon::FromBox({{16, 20}, {17, 21}}));
  // The frame moves afterwards: observations keep the place that they had when they came.
  ASSERT_TRUE(site.Edit({{SetTransform{{"map", "dock", PlanarTransform(0, 0, 0)}}}}).ok());
  EXPECT_EQ(site.Observe(observation).outcome, ObservationOutcome::kDuplicate);
  ASSERT_TRUE(site.Run(RebuildFusion{"things", "", ""}).ok());
  EXPECT_EQ(site.Find("cup")->shape, Polygon::FromBox({{16, 20}, {17, 21}}));
}

TEST(MapFusionTest, ExplanationTellsTheObservationsOfAnObject) {
  FusedSite site;
  site.Start();
  site.Observe(Sighting("a", 0, 0, {"sofa"}));
  site.Observe(Sighting("a", 1, 1, {"sofa", "cup"}));
  site.Observe(Sighting("b", 7, 2, {"cup"}));
  const auto go_on = [] { return absl::OkStatus(); };
  const auto history = ExplainObject(site.session(), "things", site.Find("cup")->id, go_on);
  ASSERT_TRUE(history.ok()) << history.status();
  EXPECT_EQ(history->track, "a/1/1");
  EXPECT_EQ(history->strategy, "tally");
  ASSERT_THAT(history->events, SizeIs(2));
  EXPECT_EQ(history->events[0].kind, ObjectEventKind::kFounded);
  EXPECT_EQ(history->events[0].detection, 1);
  EXPECT_EQ(history->events[0].at.sequence, 1);
  EXPECT_EQ(history->events[1].kind, ObjectEventKind::kSeen);
  EXPECT_EQ(history->events[1].at.robot, "b");
  EXPECT_EQ(history->events[1].existence, 1.0);
  EXPECT_TRUE(absl::IsNotFound(ExplainObject(site.session(), "things", 99, go_on).status()));
  EXPECT_TRUE(absl::IsCancelled(ExplainObject(site.session(), "things", site.Find("cup")->id, [] {
                                  return absl::CancelledError("");
                                }).status()));
}

}  // namespace
}  // namespace hypermap::server
