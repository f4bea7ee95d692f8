#include "wire/registration.h"

#include <cmath>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap::wire {
namespace {

using registration::Ambiguity;
using registration::NamedPair;
using registration::TransformAnswer;
using ::testing::HasSubstr;

TransformAnswer SomeAnswer() {
  TransformAnswer answer;
  answer.source = {"attic", "occupancy", "map", 3, 17};
  answer.target = {"office", "floor", "site", 12, 18};
  answer.estimate.best = {PlanarTransform(1.5, -2.0, 0.25), 0.9};
  answer.estimate.covariance << 1, 2, 3, 2, 5, 6, 3, 6, 9;
  answer.estimate.inlier_share = 0.95;
  answer.estimate.runner_up = registration::Mode{PlanarTransform(4, 5, -3), 0.4};
  answer.estimate.agreeing = {{3, 8, 0.01}, {4, 1, 0.02}};
  return answer;
}

TransformAnswer RoundTrip(const TransformAnswer& answer) {
  v1::EstimateTransformResponse message;
  EncodeTransformAnswer(answer, &message);
  const auto decoded = DecodeTransformAnswer(message);
  EXPECT_TRUE(decoded.ok()) << decoded.status();
  return decoded.value_or(TransformAnswer());
}

TEST(TransformAnswerTest, ComesBackAsItWas) {
  const TransformAnswer sent = SomeAnswer();
  const TransformAnswer got = RoundTrip(sent);
  EXPECT_EQ(got.source, sent.source);
  EXPECT_EQ(got.target, sent.target);
  EXPECT_EQ(got.estimate.best.target_from_source, sent.estimate.best.target_from_source);
  EXPECT_EQ(got.estimate.best.score, 0.9);
  EXPECT_EQ(got.estimate.covariance, sent.estimate.covariance);
  EXPECT_EQ(got.estimate.inlier_share, 0.95);
  ASSERT_TRUE(got.estimate.runner_up.has_value());
  EXPECT_EQ(got.estimate.runner_up->target_from_source, PlanarTransform(4, 5, -3));
  EXPECT_EQ(got.estimate.runner_up->score, 0.4);
  EXPECT_EQ(got.estimate.agreeing, sent.estimate.agreeing);
}

TEST(TransformAnswerTest, EachAmbiguityComesBack) {
  for (const Ambiguity ambiguity : {Ambiguity::kNone, Ambiguity::kLittleAgreement,
                                    Ambiguity::kRunnerUp, Ambiguity::kFreeDirection}) {
    TransformAnswer answer = SomeAnswer();
    answer.estimate.ambiguity = ambiguity;
    EXPECT_EQ(RoundTrip(answer).estimate.ambiguity, ambiguity);
  }
}

TEST(TransformAnswerTest, InfiniteCovarianceIsLeftOut) {
  TransformAnswer answer = SomeAnswer();
  answer.estimate.covariance = registration::InfiniteCovariance();
  answer.estimate.runner_up.reset();
  v1::EstimateTransformResponse message;
  EncodeTransformAnswer(answer, &message);
  EXPECT_EQ(message.covariance_size(), 0);
  EXPECT_FALSE(message.has_runner_up());
  const TransformAnswer got = RoundTrip(answer);
  EXPECT_TRUE(std::isinf(got.estimate.covariance(2, 2)));
  EXPECT_FALSE(got.estimate.runner_up.has_value());
  // Products of infinities are no numbers.
  answer.estimate.covariance(0, 1) = NAN;
  EncodeTransformAnswer(answer, &message);
  EXPECT_EQ(message.covariance_size(), 0);
}

TEST(TransformAnswerTest, WrongAnswersAreRefused) {
  v1::EstimateTransformResponse message;
  EncodeTransformAnswer(SomeAnswer(), &message);
  v1::EstimateTransformResponse wrong = message;
  wrong.clear_ambiguity();
  EXPECT_THAT(DecodeTransformAnswer(wrong).status().message(), HasSubstr("ambiguity"));
  wrong = message;
  wrong.add_covariance(1.0);
  EXPECT_THAT(DecodeTransformAnswer(wrong).status().message(), HasSubstr("covariance"));
  wrong = message;
  wrong.mutable_runner_up()->mutable_target_from_source()->set_x(INFINITY);
  EXPECT_THAT(DecodeTransformAnswer(wrong).status().message(),
              HasSubstr("runner_up.target_from_source"));
}

TEST(PointPairsTest, ComeBackAsTheyWere) {
  const std::vector<NamedPair> sent = {{"door", {{1, 2}, {3, 4}, 0.1}}, {"", {{5, 6}, {7, 8}}}};
  v1::EstimateTransformRequest message;
  EncodePointPairs(sent, &message);
  const auto got = DecodePointPairs(message);
  ASSERT_TRUE(got.ok()) << got.status();
  ASSERT_EQ(got->size(), 2u);
  EXPECT_EQ((*got)[0].name, "door");
  EXPECT_EQ((*got)[0].pair.source, (Point{1, 2}));
  EXPECT_EQ((*got)[0].pair.target, (Point{3, 4}));
  EXPECT_EQ((*got)[0].pair.sigma_m, 0.1);
  EXPECT_EQ((*got)[1].pair.sigma_m, registration::PointPair().sigma_m);
}

TEST(PointPairsTest, SigmaZeroIsTheDefault) {
  v1::EstimateTransformRequest message;
  v1::PointPair* const pair = message.add_pairs();
  pair->mutable_source();
  pair->mutable_target();
  const auto got = DecodePointPairs(message);
  ASSERT_TRUE(got.ok()) << got.status();
  EXPECT_EQ((*got)[0].pair.sigma_m, 0.05);
}

TEST(PointPairsTest, ErrorsNameThePairAndItsField) {
  const auto error_of = [](auto change) {
    v1::EstimateTransformRequest message;
    EncodePointPairs(std::vector<NamedPair>{{"", {{1, 2}, {3, 4}}}, {"door", {{1, 2}, {3, 4}}}},
                     &message);
    change(*message.mutable_pairs(1));
    return std::string(DecodePointPairs(message).status().message());
  };
  EXPECT_THAT(error_of([](v1::PointPair& pair) { pair.clear_target(); }),
              HasSubstr("pairs[1] (\"door\") has no target"));
  EXPECT_THAT(error_of([](v1::PointPair& pair) { pair.clear_source(); }), HasSubstr("no source"));
  EXPECT_THAT(error_of([](v1::PointPair& pair) { pair.mutable_source()->set_x(NAN); }),
              HasSubstr("pairs[1] (\"door\").source"));
  EXPECT_THAT(error_of([](v1::PointPair& pair) { pair.mutable_target()->set_y(INFINITY); }),
              HasSubstr("pairs[1] (\"door\").target"));
  EXPECT_THAT(error_of([](v1::PointPair& pair) { pair.set_sigma_m(-1); }),
              HasSubstr("pairs[1] (\"door\").sigma_m"));
}

TEST(PointPairsTest, TooManyAreRefused) {
  v1::EstimateTransformRequest message;
  for (int i = 0; i <= registration::kMaxPointPairs; ++i) message.add_pairs();
  EXPECT_EQ(DecodePointPairs(message).status().code(), absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace hypermap::wire
