#include "ingest/perception/observer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "ingest/perception/testing/box_scene.h"
#include "ingest/perception/testing/walled_room.h"
#include "map/geometry/overlap.h"
#include "map/observations/range_weight.h"
#include "map/observations/view_frame.h"
#include "tests/support/random_map.h"

namespace hypermap::ingest {
namespace {

using testing::BoxScene;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::LookFrom;
using testing::Mask;
using testing::Photograph;
using testing::Rectangle;
using testing::Shot;
using testing::TestCamera;
using testing::WalledRoom;
using Scores = std::map<std::string, double>;

Observer MakeObserver(const ObserverOptions& options = {},
                      const std::shared_ptr<const GridLayer>& occupancy = nullptr) {
  return Observer(MakeOrganisedSegmenter(), occupancy, options);
}

// Three crates side by side, 2 m ahead.
Shot ThreeCrates() {
  BoxScene scene;
  for (const double y : {-0.6, 0.0, 0.6}) {
    scene.boxes.push_back({{2.0, y - 0.15, 0.0}, {2.3, y + 0.15, 0.4}});
  }
  return Photograph(scene, TestCamera(320), LookFrom({0, 0, 1.2}, 0.0, 0.5), 51);
}

Frame FrameOfCrates(const std::vector<Scores>& scores) {
  const Shot shot = ThreeCrates();
  Frame frame = shot.AsFrame();
  for (size_t i = 0; i < scores.size(); ++i) {
    frame.instances.push_back({scores[i], shot.MaskOf(static_cast<int>(i))});
  }
  return frame;
}

TEST(ObserverTest, ThingsSeenBecomeDetectionsWhereTheyStand) {
  const Frame frame = FrameOfCrates({{{"crate", 0.9}}, {{"chest", 0.6}}, {{"box", 0.7}}});
  FrameReport report;
  const auto observation = MakeObserver().Observe(frame, &report);
  ASSERT_TRUE(observation.ok()) << observation.status();
  EXPECT_TRUE(Validate(*observation).ok()) << Validate(*observation);
  EXPECT_EQ(observation->robot, "r1");
  EXPECT_EQ(observation->sequence, 7);
  EXPECT_EQ(observation->stamp, frame.stamp);
  EXPECT_EQ(observation->frame_id, "map");
  EXPECT_TRUE(Placed(*observation).pose.frame_from_camera.isApprox(frame.frame_from_camera, 2e-3));
  EXPECT_EQ(report.instances, 3);
  EXPECT_EQ(report.detections, 3);
  EXPECT_EQ(report.without_points, 0);
  EXPECT_EQ(report.suppressed, 0);
  ASSERT_EQ(observation->detections.size(), 3u);
  EXPECT_EQ(observation->detections[1].scores, (Scores{{"chest", 0.6}}));
  for (int i = 0; i < 3; ++i) {
    const Detection& detection = observation->detections[i];
    const double y = 0.6 * (i - 1);
    EXPECT_GT(Iou(detection.hull, Polygon::FromBox({{2.0, y - 0.15}, {2.3, y + 0.15}})), 0.8);
    EXPECT_NEAR(detection.height.high_m, 0.4, 0.03);
    EXPECT_EQ(detection.truncation, 0.0);
    // The crates are about 2.3 m away.
    EXPECT_NEAR(detection.weight, RangeWeight(2.3), 0.05);
  }
  EXPECT_FALSE(observation->view_hull.empty());
  EXPECT_FALSE(observation->free_space.empty());
  ASSERT_TRUE(observation->depth);
  EXPECT_EQ(observation->depth->columns, 80);
}

// Owners in the depth view count detections, not instances: the first instance has no points.
TEST(ObserverTest, InstancesWithoutPointsAreCountedAndSkipped) {
  Frame frame = FrameOfCrates({{{"crate", 0.9}}, {{"crate", 0.8}}});
  frame.instances[0].mask.assign(frame.instances[0].mask.size(), 0);
  FrameReport report;
  const auto observation = MakeObserver().Observe(frame, &report);
  ASSERT_TRUE(observation.ok());
  EXPECT_TRUE(Validate(*observation).ok()) << Validate(*observation);
  EXPECT_EQ(report.without_points, 1);
  EXPECT_EQ(report.detections, 1);
  ASSERT_EQ(observation->detections.size(), 1u);
  EXPECT_EQ(observation->detections[0].scores, (Scores{{"crate", 0.8}}));
  EXPECT_THAT(observation->depth->owner, ::testing::Contains(1));
}

TEST(ObserverTest, BeyondTheLimitTheBestScoresStay) {
  const Frame frame = FrameOfCrates({{{"a", 0.6}, {"x", 0.2}}, {{"b", 0.3}}, {{"c", 0.9}}});
  FrameReport report;
  const auto observation = MakeObserver({.max_instances = 2}).Observe(frame, &report);
  ASSERT_TRUE(observation.ok());
  ASSERT_EQ(observation->detections.size(), 2u);
  EXPECT_EQ(observation->detections[0].scores, (Scores{{"a", 0.6}, {"x", 0.2}}));
  EXPECT_EQ(observation->detections[1].scores, (Scores{{"c", 0.9}}));
  EXPECT_EQ(report.instances, 3);
  EXPECT_EQ(report.suppressed, 1);
}

TEST(ObserverTest, DuplicateMasksBecomeOneDetection) {
  Frame frame = FrameOfCrates({{{"crate", 0.9}}});
  frame.instances.push_back({{{"chest", 0.5}}, frame.instances[0].mask});
  FrameReport report;
  const auto observation = MakeObserver().Observe(frame, &report);
  ASSERT_TRUE(observation.ok());
  ASSERT_EQ(observation->detections.size(), 1u);
  EXPECT_EQ(observation->detections[0].scores, (Scores{{"chest", 0.5}, {"crate", 0.9}}));
  EXPECT_EQ(report.suppressed, 1);
}

TEST(ObserverTest, GarbageFramesAreRefused) {
  Frame frame = FrameOfCrates({{{"crate", 0.9}}});
  frame.frame_from_camera.translation().x() = std::numeric_limits<double>::quiet_NaN();
  FrameReport report;
  const auto observation = MakeObserver().Observe(frame, &report);
  EXPECT_EQ(observation.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(observation.status().message()), HasSubstr("pose"));
}

// An observation that the server would refuse is an error of its frame, and does not end a stream.
TEST(ObserverTest, FramesThatGiveNoGoodObservationAreRefused) {
  Frame frame = FrameOfCrates({{{"", 0.9}}});
  EXPECT_THAT(std::string(MakeObserver().Observe(frame, nullptr).status().message()),
              HasSubstr("detections[0].scores"));
  frame = FrameOfCrates({});
  frame.pose_covariance(0, 1) = 0.5;
  EXPECT_THAT(std::string(MakeObserver().Observe(frame, nullptr).status().message()),
              HasSubstr("pose.covariance"));
  frame = FrameOfCrates({});
  frame.sequence = -1;
  EXPECT_THAT(std::string(MakeObserver().Observe(frame, nullptr).status().message()),
              HasSubstr("sequence"));
}

// The polynomials of these lenses have no inverse in the image.
TEST(ObserverTest, LensesBeyondSenseDoNoHarm) {
  for (const double k1 : {-1e6, -3.0, 3.0, 1e6}) {
    Frame frame = FrameOfCrates({{{"crate", 0.9}}});
    frame.camera.distortion[0] = k1;
    frame.pose_covariance = Eigen::Vector3d(0.01, 0.01, 0.001).asDiagonal();
    const auto observation = MakeObserver({}, testing::WalledRoomGrid()).Observe(frame, nullptr);
    if (!observation.ok()) {
      EXPECT_EQ(observation.status().code(), absl::StatusCode::kInvalidArgument);
      continue;
    }
    EXPECT_TRUE(Validate(*observation).ok()) << k1 << " " << Validate(*observation);
    for (const Detection& detection : observation->detections) {
      for (const Point& p : detection.hull.outer()) EXPECT_TRUE(IsFinite(p)) << k1;
    }
  }
}

bool HasFiniteVertices(const Polygon& polygon) {
  return polygon.empty() || std::all_of(polygon.outer().begin(), polygon.outer().end(), &IsFinite);
}

// Numbers at and between the ends of what Validate(Frame) accepts, in any combination.
TEST(ObserverTest, NumbersBeyondSenseDoNoHarm) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  hypermap::testing::Rng rng(seed);
  const auto one_of = [&rng](std::initializer_list<double> numbers) {
    const auto count = static_cast<int>(numbers.size());
    return numbers.begin()[hypermap::testing::UniformInt(rng, 0, count - 1)];
  };
  const Observer observer = MakeObserver({}, testing::WalledRoomGrid());
  const Shot shot = Photograph(WalledRoom(), TestCamera(32), LookFrom({0, 0, 0.9}, 0.5, 0.25));
  for (int round = 0; round < 300; ++round) {
    Frame frame = shot.AsFrame();
    frame.camera.fx = one_of({1.0, 10.0, frame.camera.fx, 1e6});
    frame.camera.fy = one_of({1.0, 10.0, frame.camera.fy, 1e6});
    frame.camera.cx = one_of({-1e6, -100.0, frame.camera.cx, 1e6});
    frame.camera.cy = one_of({-1e6, -100.0, frame.camera.cy, 1e6});
    for (double& k : frame.camera.distortion) k = one_of({0.0, 0.0, 0.0, 0.3, -1e3, 1e6, -1e6});
    for (float& metres : frame.depth.metres) {
      const bool is_spoilt = hypermap::testing::UniformInt(rng, 0, 3) == 0;
      if (is_spoilt) metres = static_cast<float>(one_of({1e-44, 1e-3, 7.9, 1e9, 1e30, 3.4e38}));
    }
    frame.frame_from_camera.translation() +=
        Eigen::Vector3d(one_of({0.0, -1e9, 1e9}), one_of({0.0, 1e9}), one_of({0.0, 0.0, 1e9}));
    frame.pose_covariance = Eigen::Vector3d(one_of({0.01, 1e-300, 1e12}), one_of({0.01, 1e12}),
                                            one_of({0.001, 1e-300, 1e12}))
                                .asDiagonal();
    frame.instances.push_back({{{"all", 0.9}}, Mask(frame.depth.metres.size(), 1)});
    frame.instances.push_back({{{"part", 0.8}}, Rectangle(32, 24, 4, 4, 20, 20)});
    const auto observation = observer.Observe(frame, nullptr);
    if (!observation.ok()) {
      ASSERT_EQ(observation.status().code(), absl::StatusCode::kInvalidArgument)
          << observation.status();
      continue;
    }
    for (const Detection& detection : observation->detections) {
      ASSERT_TRUE(HasFiniteVertices(detection.hull));
    }
    ASSERT_TRUE(HasFiniteVertices(observation->view_hull));
    ASSERT_TRUE(HasFiniteVertices(observation->free_space));
  }
}

TEST(ObserverTest, GivesUpWhereverItIsCancelled) {
  const Frame frame = FrameOfCrates({{{"crate", 0.9}}, {{"chest", 0.6}}, {{"box", 0.7}}});
  const int times = TimesCancelled([&frame] {
    // A new one, which has not cached the rays of the pixels.
    return MakeObserver().Observe(frame, nullptr).status();
  });
  EXPECT_GT(times, 10);
}

TEST(ObserverTest, FrameWithoutReturnsHasSeenNothing) {
  Frame frame = FrameOfCrates({{{"crate", 0.9}}, {{"crate", 0.8}}});
  frame.depth.metres.assign(frame.depth.metres.size(), 0.0f);
  FrameReport report;
  const auto observation = MakeObserver().Observe(frame, &report);
  ASSERT_TRUE(observation.ok());
  EXPECT_TRUE(Validate(*observation).ok()) << Validate(*observation);
  EXPECT_THAT(observation->detections, IsEmpty());
  EXPECT_TRUE(observation->view_hull.empty());
  EXPECT_TRUE(observation->free_space.empty());
  EXPECT_EQ(report.without_points, 2);
}

TEST(ObserverTest, DepthsOfNoUseAreTaken) {
  for (const float metres : {1e-30f, 1e-3f, 1e4f, 1e30f}) {
    Frame frame = FrameOfCrates({{{"crate", 0.9}}});
    frame.depth.metres.assign(frame.depth.metres.size(), metres);
    const auto observation = MakeObserver().Observe(frame, nullptr);
    ASSERT_TRUE(observation.ok()) << metres;
    EXPECT_TRUE(Validate(*observation).ok()) << metres << " " << Validate(*observation);
  }
}

TEST(ObserverTest, TenThousandInstancesAreCutToTheLimit) {
  const CameraModel camera = TestCamera(32);
  const Shot shot = Photograph({}, camera, LookFrom({0, 0, 1.2}, 0.0, 0.5));
  Frame frame = shot.AsFrame();
  for (int i = 0; i < 10000; ++i) {
    const int u = i % 30;
    const int v = i / 30 % 22;
    frame.instances.push_back(
        {{{"thing", (i + 1) / 10000.0}}, Rectangle(32, 24, u, v, u + 2, v + 2)});
  }
  FrameReport report;
  const auto observation = MakeObserver().Observe(frame, &report);
  ASSERT_TRUE(observation.ok());
  EXPECT_TRUE(Validate(*observation).ok()) << Validate(*observation);
  EXPECT_EQ(report.instances, 10000);
  EXPECT_GE(report.suppressed, 10000 - 254);
  EXPECT_EQ(report.detections + report.without_points + report.suppressed, 10000);
}

// In the walled room, the claimed pose is wrong by 8.5 cm and 1 degree.
TEST(ObserverTest, OccupancyCorrectsThePose) {
  const Eigen::Isometry3d truth = LookFrom({-0.8, -0.7, 0.9}, 0.55, 0.25);
  Frame frame = Photograph(WalledRoom(), TestCamera(160), truth, 52).AsFrame();
  frame.frame_from_camera = LookFrom({-0.74, -0.76, 0.9}, 0.57, 0.25);
  frame.pose_covariance = Eigen::Vector3d(0.0064, 0.0064, 0.0009).asDiagonal();
  const auto with = MakeObserver({}, testing::WalledRoomGrid()).Observe(frame, nullptr);
  const auto without = MakeObserver().Observe(frame, nullptr);
  ASSERT_TRUE(with.ok());
  ASSERT_TRUE(without.ok());
  EXPECT_TRUE(Validate(*with).ok()) << Validate(*with);
  EXPECT_LT((Placed(*with).pose.frame_from_camera.translation() - truth.translation()).norm(),
            0.03);
  EXPECT_LT(with->pose.covariance.trace(), frame.pose_covariance.trace());
  EXPECT_EQ(without->frame_from_view, RoundedViewPose(frame.frame_from_camera));
  EXPECT_EQ(without->pose.covariance, frame.pose_covariance);
}

// Two robots see the same, and take themselves to be elsewhere, and otherwise tilted.
TEST(ObserverTest, WhatIsSeenDoesNotDependOnThePose) {
  Frame frame = FrameOfCrates({{{"crate", 0.9}}, {{"chest", 0.6}}, {{"box", 0.7}}});
  const absl::StatusOr<Observation> a = MakeObserver().Observe(frame, nullptr);
  frame.frame_from_camera = LookFrom({12.3, -4.56, 1.207}, 2.1, 0.508);
  frame.pose_covariance = Eigen::Vector3d(0.04, 0.04, 0.01).asDiagonal();
  const absl::StatusOr<Observation> b =
      MakeObserver({}, testing::WalledRoomGrid()).Observe(frame, nullptr);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_NE(a->frame_from_view, b->frame_from_view);
  EXPECT_EQ(a->pose.frame_from_camera.matrix(), b->pose.frame_from_camera.matrix());
  EXPECT_EQ(a->view_hull, b->view_hull);
  EXPECT_EQ(a->free_space, b->free_space);
  EXPECT_EQ(a->depth, b->depth);
  EXPECT_EQ(a->detections, b->detections);
  // A pose that is known to more digits is taken as it is.
  frame.frame_from_view = PlanarTransform(12.3 + 1e-14, -4.56, 2.1);
  EXPECT_EQ(MakeObserver().Observe(frame, nullptr)->frame_from_view, frame.frame_from_view);
}

TEST(ObserverTest, CameraMayChangeBetweenFrames) {
  const Observer observer = MakeObserver();
  const BoxScene crate{true, {{{2.0, -0.15, 0.0}, {2.3, 0.15, 0.4}}}};
  for (const double zoom : {1.0, 1.5, 1.0}) {
    CameraModel camera = TestCamera(320);
    camera.fx *= zoom;
    camera.fy *= zoom;
    const Shot shot = Photograph(crate, camera, LookFrom({0, 0, 1.2}, 0.0, 0.5));
    Frame frame = shot.AsFrame();
    frame.instances.push_back({{{"crate", 0.9}}, shot.MaskOf(0)});
    const auto observation = observer.Observe(frame, nullptr);
    ASSERT_TRUE(observation.ok());
    ASSERT_EQ(observation->detections.size(), 1u);
    EXPECT_GT(Iou(observation->detections[0].hull, Polygon::FromBox({{2.0, -0.15}, {2.3, 0.15}})),
              0.8)
        << zoom;
  }
}

}  // namespace
}  // namespace hypermap::ingest
