#include "map/observations/observation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "map/geometry/predicates.h"
#include "map/observations/view_frame.h"

namespace hypermap {
namespace {

using ::testing::HasSubstr;

// A cup 2 m ahead of a camera at a height of 1 m, which looks straight ahead.
Observation SeenFrom(const PlanarTransform& frame_from_view) {
  Observation observation;
  observation.robot = "a";
  observation.stamp = absl::FromUnixSeconds(1'700'000'000);
  observation.frame_from_view = frame_from_view;
  observation.pose.frame_from_camera = ViewFromCamera(-Eigen::Vector3d::UnitY(), 1.0);
  observation.pose.covariance = Eigen::Vector3d(0.04, 0.01, 0.002).asDiagonal();
  observation.view_hull = Polygon::FromBox({{0.0, -2.0}, {4.0, 2.0}});
  observation.free_space = Polygon::FromBox({{0.5, -0.5}, {1.5, 0.5}});
  Detection cup;
  cup.scores = {{"cup", 0.9}};
  cup.hull = Polygon::FromBox({{2.0, -0.1}, {2.1, 0.1}});
  cup.cells = {PlanarTransform(), 0.01, {{-10, 200, 210}, {9, 200, 210}}};
  observation.detections = {cup};
  return observation;
}

TEST(PlacedTest, WhatWasSeenLiesWhereTheViewIs) {
  const Observation placed = Placed(SeenFrom({5.0, 1.0, M_PI / 2}));
  EXPECT_FALSE(placed.frame_from_view);
  const Point cup = Centroid(placed.detections[0].hull);
  EXPECT_NEAR(cup.x, 5.0, 1e-12);
  EXPECT_NEAR(cup.y, 3.05, 1e-12);
  EXPECT_EQ(placed.detections[0].cells.frame_from_cells, PlanarTransform(5.0, 1.0, M_PI / 2));
  EXPECT_NEAR(Centroid(placed.free_space).y, 2.0, 1e-12);
  EXPECT_NEAR(placed.view_hull.bounds().max.y, 5.0, 1e-12);
  EXPECT_NEAR(ViewPose(placed.pose.frame_from_camera).yaw(), M_PI / 2, 1e-12);
  EXPECT_EQ(placed.pose.frame_from_camera.translation(), Eigen::Vector3d(5.0, 1.0, 1.0));
  // It is that of the pose in the frame already.
  EXPECT_EQ(placed.pose.covariance, SeenFrom({}).pose.covariance);
  // One that is placed stays as it is.
  EXPECT_EQ(Placed(placed).detections, placed.detections);
}

TEST(TransformedTest, MovesTheViewAlone) {
  const Observation seen = SeenFrom({5.0, 1.0, 0.5});
  const PlanarTransform target_from_source(1.0, 2.0, M_PI / 2);
  const Observation moved = Transformed(seen, target_from_source, "dock");
  EXPECT_EQ(moved.frame_id, "dock");
  EXPECT_EQ(moved.frame_from_view, target_from_source * *seen.frame_from_view);
  EXPECT_EQ(moved.detections, seen.detections);
  EXPECT_EQ(moved.view_hull, seen.view_hull);
  EXPECT_EQ(moved.free_space, seen.free_space);
  EXPECT_EQ(moved.pose.frame_from_camera.matrix(), seen.pose.frame_from_camera.matrix());
  const Observation other = Transformed(Placed(seen), target_from_source, "dock");
  EXPECT_TRUE(moved.pose.covariance.isApprox(other.pose.covariance));
  const Point a = Centroid(Placed(moved).free_space), b = Centroid(other.free_space);
  EXPECT_NEAR(a.x, b.x, 1e-12);
  EXPECT_NEAR(a.y, b.y, 1e-12);
}

TEST(ValidateTest, TheCameraIsAboveItsViewAndLooksAlongIt) {
  const auto error = [](const Observation& observation) {
    return std::string(Validate(observation).message());
  };
  EXPECT_EQ(error(SeenFrom({1.0, 2.0, 3.0})), "");
  Observation beside = SeenFrom({});
  beside.pose.frame_from_camera.translation().y() = 0.01;
  EXPECT_THAT(error(beside), HasSubstr("view.camera"));
  Observation turned = SeenFrom({});
  turned.pose.frame_from_camera.prerotate(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitZ()));
  EXPECT_THAT(error(turned), HasSubstr("view.camera"));
  turned.frame_from_view.reset();
  EXPECT_EQ(error(turned), "");
}

TEST(ValidateTest, WhatWasSeenCanBeStoredWhereTheViewIs) {
  const auto error = [](const PlanarTransform& frame_from_view) {
    return std::string(Validate(SeenFrom(frame_from_view)).message());
  };
  EXPECT_EQ(error({9.9e8, 0.0, 0.0}), "");
  EXPECT_THAT(error({1e9, 0.0, 0.0}), HasSubstr("view.frame_from_view"));
  EXPECT_THAT(error({2e9, 0.0, 0.0}), HasSubstr("view.frame_from_view"));
}

}  // namespace
}  // namespace hypermap
