#include "client_libs/ros2/conversion/rigid_transform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace hypermap::ros2 {
namespace {

RigidTransform Turn(double angle, double x, double y, double z) {
  return {{x, y, z},
          Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 3).normalized()))};
}

Eigen::Matrix4d MatrixOf(const RigidTransform& transform) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = transform.rotation.toRotationMatrix();
  matrix.topRightCorner<3, 1>() = transform.translation;
  return matrix;
}

TEST(RigidTransformTest, ComposesLikeMatrices) {
  const RigidTransform a = Turn(0.7, 1, -2, 3);
  const RigidTransform b = Turn(-2.1, 0.5, 0, 9);
  EXPECT_TRUE(MatrixOf(a * b).isApprox(MatrixOf(a) * MatrixOf(b), 1e-12));
  EXPECT_TRUE(MatrixOf(a.Inverse()).isApprox(MatrixOf(a).inverse(), 1e-12));
}

TEST(RigidTransformTest, InterpolationTurnsTheShorterWay) {
  const RigidTransform begin = Turn(0.2, 1, 0, 0);
  RigidTransform end = Turn(1.4, 3, 0, 0);
  EXPECT_TRUE(
      MatrixOf(Interpolate(begin, end, 0.25)).isApprox(MatrixOf(Turn(0.5, 1.5, 0, 0)), 1e-12));
  end.rotation.coeffs() *= -1;  // the same rotation
  EXPECT_TRUE(
      MatrixOf(Interpolate(begin, end, 0.25)).isApprox(MatrixOf(Turn(0.5, 1.5, 0, 0)), 1e-12));
}

TEST(RigidTransformTest, RoundedQuaternionsGetLength1) {
  const auto transform = ToRigidTransform({{1, 2, 3}, {0, 0, 0, 1.005}});
  ASSERT_TRUE(transform.ok()) << transform.status();
  EXPECT_EQ(transform->rotation.w(), 1.0);
  EXPECT_EQ(transform->translation, Eigen::Vector3d(1, 2, 3));
}

TEST(RigidTransformTest, NumbersThatAreNoTransformAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const geometry_msgs::Transform& message :
       {geometry_msgs::Transform{{nan, 0, 0}, {}}, geometry_msgs::Transform{{0, infinity, 0}, {}},
        geometry_msgs::Transform{{}, {0, 0, 0, 0}}, geometry_msgs::Transform{{}, {0, 0, 0, 1.02}},
        geometry_msgs::Transform{{}, {0, nan, 0, 1}}}) {
    EXPECT_EQ(ToRigidTransform(message).status().code(), absl::StatusCode::kInvalidArgument);
  }
}

TEST(RigidTransformTest, StampsAreSince1970) {
  EXPECT_EQ(Nanoseconds({-1, 999'999'999}), -1);
  EXPECT_EQ(FromStamp({12, 500'000'000}), absl::FromUnixMillis(12'500));
}

}  // namespace
}  // namespace hypermap::ros2
