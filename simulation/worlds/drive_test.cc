#include "simulation/worlds/drive.h"

#include <cmath>
#include <numbers>

#include "gtest/gtest.h"

namespace hypermap::simulation {
namespace {

TEST(DriveTest, MovesSteadilyFromEndToEnd) {
  const Ring path = MakeOffice(1).path;
  const std::vector<PlanarTransform> way = DriveAlong(path);
  EXPECT_GT(way.size(), 150u);
  EXPECT_LT(way.size(), 400u);
  EXPECT_EQ(way.front().x(), path.front().x);
  EXPECT_NEAR(way.back().x(), path.back().x, 0.1);
  for (size_t i = 1; i < way.size(); ++i) {
    EXPECT_LE(std::hypot(way[i].x() - way[i - 1].x(), way[i].y() - way[i - 1].y()), 0.081);
    const double turn = std::remainder(way[i].yaw() - way[i - 1].yaw(), 2 * std::numbers::pi);
    EXPECT_LE(std::abs(turn), 10.1 * std::numbers::pi / 180);
  }
}

TEST(DriveTest, TheCameraLooksAheadAndDown) {
  const Eigen::Isometry3d pose = CameraPose({2, 3, std::numbers::pi / 2});
  EXPECT_TRUE(pose.linear().isUnitary(1e-12));
  EXPECT_NEAR(pose.linear().determinant(), 1.0, 1e-12);
  const Eigen::Vector3d forward = pose.linear().col(2), right = pose.linear().col(0);
  const double tilt = 18 * std::numbers::pi / 180;
  EXPECT_TRUE(forward.isApprox(Eigen::Vector3d(0, std::cos(tilt), -std::sin(tilt)), 1e-9));
  EXPECT_TRUE(right.isApprox(Eigen::Vector3d(1, 0, 0), 1e-9));
  EXPECT_LT(pose.linear().col(1).z(), 0.0);
  EXPECT_TRUE(pose.translation().isApprox(Eigen::Vector3d(2, 3, 1.1)));
}

TEST(DriveTest, PoseErrorIsSmallAndSlow) {
  Random random(5);
  const std::vector<PlanarTransform> still(20000, PlanarTransform(1, 2, 0));
  const std::vector<PlanarTransform> believed = WithPoseError(still, random);
  double squares = 0, steps = 0, yaw = 0;
  for (size_t i = 1; i < believed.size(); ++i) {
    squares += std::pow(believed[i].x() - 1, 2);
    steps += std::pow(believed[i].x() - believed[i - 1].x(), 2);
    yaw += std::pow(believed[i].yaw(), 2);
  }
  const double n = static_cast<double>(believed.size());
  EXPECT_NEAR(std::sqrt(squares / n), 0.045, 0.006);
  EXPECT_LT(std::sqrt(steps / n), 0.012);
  EXPECT_NEAR(std::sqrt(yaw / n), 0.9 * std::numbers::pi / 180, 0.003);
}

}  // namespace
}  // namespace hypermap::simulation
