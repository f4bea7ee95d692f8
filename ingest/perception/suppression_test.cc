#include "ingest/perception/suppression.h"

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "ingest/perception/testing/box_scene.h"

namespace hypermap::ingest {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::Rectangle;
using Scores = std::map<std::string, double>;

// A frame of 40 x 30 pixels.
Frame With(std::vector<Instance> instances) {
  Frame frame;
  frame.camera = testing::TestCamera(40);
  frame.instances = std::move(instances);
  return frame;
}

// A mask of the columns u_begin <= u < u_end in ten rows.
testing::Mask Columns(int u_begin, int u_end) { return Rectangle(40, 30, u_begin, 5, u_end, 15); }

TEST(SuppressionTest, BestScoreIsThatOfTheLikeliestClass) {
  EXPECT_EQ(BestScore({{{"chair", 0.3}, {"couch", 0.6}, {"bed", 0.1}}, {}}), 0.6);
}

// The masks have 18 of 22 columns in common.
TEST(SuppressionTest, DuplicateGivesItsClassesToTheBetterOne) {
  const Suppressed result =
      SuppressDuplicates(With({{{{"chair", 0.5}, {"bench", 0.4}}, Columns(0, 20)},
                               {{{"couch", 0.7}, {"bench", 0.2}}, Columns(2, 22)}}));
  EXPECT_THAT(result.kept, ElementsAre(1));
  EXPECT_THAT(result.scores, ElementsAre(Scores{{"bench", 0.4}, {"chair", 0.5}, {"couch", 0.7}}));
}

TEST(SuppressionTest, MasksApartStay) {
  const Suppressed result = SuppressDuplicates(
      With({{{{"chair", 0.5}}, Columns(0, 20)}, {{{"chair", 0.7}}, Columns(20, 40)}}));
  EXPECT_THAT(result.kept, ElementsAre(0, 1));
  EXPECT_THAT(result.scores, ElementsAre(Scores{{"chair", 0.5}}, Scores{{"chair", 0.7}}));
}

// The masks, of two neighbours of one class, have 10 of 30 columns in common.
TEST(SuppressionTest, MasksThatOverlapByAThirdStay) {
  const Suppressed result = SuppressDuplicates(
      With({{{{"chair", 0.5}}, Columns(0, 20)}, {{{"chair", 0.7}}, Columns(10, 30)}}));
  EXPECT_THAT(result.kept, ElementsAre(0, 1));
}

// A part of a chair is no other chair, but a cup in front of a chair is a cup.
TEST(SuppressionTest, WhatLiesInAnotherGoesWhenOfTheSameClass) {
  const Instance whole{{{"chair", 0.8}, {"cup", 0.1}}, Columns(0, 30)};
  const Suppressed same = SuppressDuplicates(With({{{{"chair", 0.6}}, Columns(5, 10)}, whole}));
  EXPECT_THAT(same.kept, ElementsAre(1));
  EXPECT_THAT(same.scores, ElementsAre(Scores{{"chair", 0.8}, {"cup", 0.1}}));
  const Suppressed other = SuppressDuplicates(With({{{{"cup", 0.6}}, Columns(5, 10)}, whole}));
  EXPECT_THAT(other.kept, ElementsAre(0, 1));
  EXPECT_THAT(other.scores, ElementsAre(Scores{{"cup", 0.6}}, whole.scores));
}

TEST(SuppressionTest, BetterOneThatLiesInAnotherOfItsClassStays) {
  const Suppressed result = SuppressDuplicates(
      With({{{{"chair", 0.6}}, Columns(0, 30)}, {{{"chair", 0.9}}, Columns(5, 10)}}));
  EXPECT_THAT(result.kept, ElementsAre(1));
}

TEST(SuppressionTest, OfEqualScoresTheFirstStays) {
  const Suppressed result = SuppressDuplicates(
      With({{{{"tv", 0.5}}, Columns(0, 20)}, {{{"screen", 0.5}}, Columns(0, 20)}}));
  EXPECT_THAT(result.kept, ElementsAre(0));
  EXPECT_THAT(result.scores, ElementsAre(Scores{{"screen", 0.5}, {"tv", 0.5}}));
}

TEST(SuppressionTest, EmptyMasksAreNobodysDuplicates) {
  const Suppressed result = SuppressDuplicates(With({{{{"tv", 0.5}}, Columns(0, 0)},
                                                     {{{"tv", 0.6}}, Columns(0, 0)},
                                                     {{{"tv", 0.7}}, Columns(0, 20)}}));
  EXPECT_THAT(result.kept, ElementsAre(0, 1, 2));
}

TEST(SuppressionTest, FrameWithoutInstancesHasNoneLeft) {
  EXPECT_THAT(SuppressDuplicates(With({})).kept, IsEmpty());
}

}  // namespace
}  // namespace hypermap::ingest
