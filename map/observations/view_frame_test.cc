#include "map/observations/view_frame.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hypermap {
namespace {

// A camera that looks along `yaw`, down by `pitch`, and is turned by `roll` about its optical axis.
Eigen::Isometry3d TiltedCamera(double x, double y, double yaw, double pitch, double roll = 0.0) {
  Eigen::Matrix3d optical;  // Looks along x; z is up.
  optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                  Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) * optical *
                  Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ());
  pose.translation() = Eigen::Vector3d(x, y, 1.2);
  return pose;
}

TEST(ViewPoseTest, IsBelowTheCameraAndLooksAlongIt) {
  for (const double pitch : {-0.3, 0.0, 0.7}) {
    const PlanarTransform view = ViewPose(TiltedCamera(1.0, -2.0, 2.5, pitch));
    EXPECT_EQ(view.x(), 1.0);
    EXPECT_EQ(view.y(), -2.0);
    EXPECT_NEAR(view.yaw(), 2.5, 1e-12);
  }
  // The upper edge of the image of a camera that looks down is ahead.
  EXPECT_NEAR(ViewPose(TiltedCamera(0.0, 0.0, 0.4, M_PI / 2)).yaw(), 0.4, 1e-12);
}

TEST(ViewPoseTest, RoundedOnesDoNotDependOnHowARotationIsWritten) {
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Isometry3d pose = TiltedCamera(0.37 * i, -1.0 / (i + 1), 0.0061 * i, 0.3);
    const Eigen::Quaterniond written(pose.linear());
    Eigen::Isometry3d read = pose;
    read.linear() = Eigen::Quaterniond(-2.0 * written.coeffs()).normalized().toRotationMatrix();
    EXPECT_EQ(RoundedViewPose(read), RoundedViewPose(pose)) << i;
    EXPECT_NEAR(RoundedViewPose(pose).yaw(), ViewPose(pose).yaw(), 1e-9);
    EXPECT_NEAR(RoundedViewPose(pose).x(), pose.translation().x(), 1e-9);
  }
}

TEST(ViewFromCameraTest, IsTheRestOfThePose) {
  for (const double pitch : {-M_PI / 2, -0.3, 0.0, 0.7, 1.55, M_PI / 2}) {
    for (const double roll : {-0.2, 0.0, 0.1, 1.5, 3.1}) {
      const Eigen::Isometry3d pose = TiltedCamera(1.0, -2.0, 2.5, pitch, roll);
      const Eigen::Isometry3d view_from_camera = ViewFromCamera(pose.linear().row(2), 1.2);
      const PlanarTransform in_view = ViewPose(view_from_camera);
      EXPECT_EQ(in_view.x(), 0.0);
      EXPECT_EQ(in_view.y(), 0.0);
      EXPECT_NEAR(in_view.yaw(), 0.0, 1e-12);
      EXPECT_TRUE((ViewPose(pose).InSpace() * view_from_camera).isApprox(pose, 1e-9))
          << pitch << " " << roll;
    }
  }
}

}  // namespace
}  // namespace hypermap
