#include "map/fusion/evidence_associate.h"

#include <algorithm>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap::fusion {
namespace {

using hypermap::testing::Rng;
using hypermap::testing::TestSeed;
using hypermap::testing::Uniform;

// Detections and tracks of squares of 0.4 m, at these positions along the x axis.
class Row {
 public:
  Row(const std::vector<double>& detected, const std::vector<double>& tracked)
      : observed_(detected.size()) {
    for (size_t i = 0; i < detected.size(); ++i) {
      observed_[i].height = {0.0, 0.5};
      FrameDetection& detection = detections.emplace_back();
      detection.detection = &observed_[i];
      detection.label = "bin";
      detection.hull = Square(detected[i]);
    }
    for (const double x : tracked) {
      FrameTrack& added = tracks.emplace_back();
      added.track = std::make_shared<Track>();
      added.track->class_mass["bin"] = 1.0;
      added.track->low.Add(0.0, 1.0, -1.0);
      added.track->high.Add(0.5, 1.0, 1.0);
      added.track->outline = Square(x);
    }
    WidenOutlines(0.02, &detections, &tracks);
  }
  Row(const Row&) = delete;
  Row& operator=(const Row&) = delete;

  std::vector<FrameDetection> detections;
  std::vector<FrameTrack> tracks;

 private:
  static Polygon Square(double x) { return Polygon::FromBox(Box{{x, 0.0}, {x + 0.4, 0.4}}); }

  std::vector<Detection> observed_;
};

TEST(EvidenceAssociateTest, DetectionWithoutATrackFoundsOne) {
  const Row row({0.0, 3.0}, {0.05});
  const auto matches = Associate(row.detections, row.tracks, {});
  ASSERT_EQ(matches.size(), 2u);
  ASSERT_TRUE(matches[0]);
  EXPECT_EQ(matches[0]->track, 0u);
  EXPECT_EQ(matches[0]->score, AssociationScore(row.detections[0], row.tracks[0], {}));
  EXPECT_FALSE(matches[1]);
}

TEST(EvidenceAssociateTest, OtherHeightsAndOtherClassesScoreLess) {
  Row row({0.0}, {0.0});
  const double same = AssociationScore(row.detections[0], row.tracks[0], {});
  EXPECT_NEAR(same, 1.0, 1e-9);
  row.detections[0].label = "box";
  EXPECT_NEAR(AssociationScore(row.detections[0], row.tracks[0], {}), 0.5, 1e-9);
  row.tracks[0].track->low = row.tracks[0].track->high = {};
  row.tracks[0].track->low.Add(1.0, 1.0, -1.0);
  row.tracks[0].track->high.Add(1.5, 1.0, 1.0);
  EXPECT_EQ(AssociationScore(row.detections[0], row.tracks[0], {}), 0.0);
}

// Tries all one-to-one associations of three detections with three tracks, or none.
TEST(EvidenceAssociateTest, SumOfScoresIsTheLargest) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  const auto random = [&rng] { return Uniform(rng, 0.0, 1.0); };
  for (int round = 0; round < 50; ++round) {
    const Row row({random(), random(), random()}, {random(), random(), random()});
    double sum = 0.0;
    std::vector<size_t> used;
    for (const auto& match : Associate(row.detections, row.tracks, {})) {
      if (!match) continue;
      sum += match->score;
      used.push_back(match->track);
    }
    std::sort(used.begin(), used.end());
    EXPECT_EQ(std::adjacent_find(used.begin(), used.end()), used.end());
    // A pair with a score of 0 counts as none, so permutations cover all associations.
    double best = 0.0;
    std::vector<size_t> order = {0, 1, 2};
    do {
      double other = 0.0;
      for (size_t i = 0; i < 3; ++i) {
        other += AssociationScore(row.detections[i], row.tracks[order[i]], {});
      }
      best = std::max(best, other);
    } while (std::next_permutation(order.begin(), order.end()));
    EXPECT_NEAR(sum, best, 1e-5);
  }
}

TEST(EvidenceAssociateTest, BufferGrowsWithTheErrorOfThePoseUpToABound) {
  EvidenceParameters parameters;
  SensorPose pose;
  EXPECT_DOUBLE_EQ(AssociationBuffer(pose, parameters), 0.01);
  pose.covariance(0, 0) = pose.covariance(1, 1) = 0.05 * 0.05;
  EXPECT_DOUBLE_EQ(AssociationBuffer(pose, parameters), 0.03);
  pose.covariance(0, 0) = pose.covariance(1, 1) = 1.0;
  EXPECT_DOUBLE_EQ(AssociationBuffer(pose, parameters), 0.05);
  parameters.max_buffer_m = 0.2;
  EXPECT_DOUBLE_EQ(AssociationBuffer(pose, parameters), 0.2);
}

}  // namespace
}  // namespace hypermap::fusion
