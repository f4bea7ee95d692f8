#include "ingest/perception/organised_cloud.h"

#include <cmath>

#include "gtest/gtest.h"
#include "ingest/perception/testing/box_scene.h"

namespace hypermap::ingest {
namespace {

using testing::BoxScene;
using testing::LookFrom;
using testing::Photograph;
using testing::TestCamera;

// Distorts the ray (x, y, 1) by the plumb_bob model as ROS camera_info documents it.
Eigen::Vector2d Distort(const std::array<double, 5>& distortion, double x, double y) {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const double r2 = x * x + y * y;
  const double radial = 1 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
  return {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
          y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

DepthImage OnePixel(const CameraModel& camera, int u, int v, float metres) {
  DepthImage depth{camera.width, camera.height, {}};
  depth.metres.assign(static_cast<size_t>(camera.width) * camera.height, 0.0f);
  depth.metres[v * camera.width + u] = metres;
  return depth;
}

TEST(PixelRaysTest, ArePinholesRowByRow) {
  const CameraModel camera{4, 3, 2.0, 4.0, 1.5, 1.0};
  const auto rays = PixelRays(camera);
  ASSERT_EQ(rays.size(), 12u);
  EXPECT_EQ(rays[0], Eigen::Vector2f(-0.75f, -0.25f));  // Pixel (0, 0).
  EXPECT_EQ(rays[3], Eigen::Vector2f(0.75f, -0.25f));   // Pixel (3, 0).
  EXPECT_EQ(rays[5], Eigen::Vector2f(-0.25f, 0.0f));    // Pixel (1, 1).
  EXPECT_EQ(rays[11], Eigen::Vector2f(0.75f, 0.25f));   // Pixel (3, 2).
}

TEST(PixelRaysTest, UndoTheLens) {
  const std::array<double, 5> lenses[] = {
      {0.2624, -0.9531, -0.0054, 0.0026, 1.1633},  // A Kinect's colour camera.
      {-0.25, 0.08, 0.001, -0.002, 0.0},           // Barrel distortion.
      {0.1, 0.0, 0.0, 0.0, 0.0},                   // Pincushion distortion.
  };
  for (const auto& lens : lenses) {
    for (const double x : {-0.55, -0.2, 0.0, 0.3, 0.55}) {
      for (const double y : {-0.42, 0.0, 0.1, 0.42}) {
        // The principal point is shifted so that the ray meets the centre of pixel (7, 5).
        const Eigen::Vector2d seen = Distort(lens, x, y);
        const CameraModel camera{9, 8, 100, 100, 7 - 100 * seen.x(), 5 - 100 * seen.y(), lens};
        const Eigen::Vector2f ray = PixelRays(camera)[5 * 9 + 7];
        EXPECT_NEAR(ray.x(), x, 1e-5) << "k1 " << lens[0] << " at " << x << ", " << y;
        EXPECT_NEAR(ray.y(), y, 1e-5) << "k1 " << lens[0] << " at " << x << ", " << y;
      }
    }
  }
}

TEST(PixelRaysTest, ProjectionIsTheWayBack) {
  const CameraModel camera{40, 30, 35, 36, 19, 15, {0.26, -0.9, -0.005, 0.003, 1.1}};
  const auto rays = PixelRays(camera);
  for (int v = 0; v < 30; ++v) {
    for (int u = 0; u < 40; ++u) {
      const Eigen::Vector2d seen = Project(camera, rays[v * 40 + u].cast<double>());
      EXPECT_NEAR(seen.x(), u, 1e-3);
      EXPECT_NEAR(seen.y(), v, 1e-3);
    }
  }
}

TEST(OrganisedCloudTest, PointsLieAlongTheRaysOfTheirPixels) {
  const CameraModel camera{4, 3, 2.0, 4.0, 1.5, 1.0};
  const auto cloud =
      MakeCloud(OnePixel(camera, 3, 2, 2.0f), Eigen::Isometry3d::Identity(), PixelRays(camera));
  ASSERT_EQ(cloud.camera.size(), 12u);
  EXPECT_EQ(cloud.camera[11], Eigen::Vector3f(1.5f, 0.5f, 2.0f));
  EXPECT_TRUE(cloud.valid(11));
  for (int i = 0; i < 11; ++i) EXPECT_FALSE(cloud.valid(i));
}

// From 1 m up, 45 degrees down, the optical axis meets the floor sqrt(2) m away, 1 m ahead.
TEST(OrganisedCloudTest, CameraLookingDownMeetsTheFloorAhead) {
  const CameraModel camera{3, 3, 2.0, 2.0, 1.0, 1.0};
  const auto cloud = MakeCloud(OnePixel(camera, 1, 1, std::sqrt(2.0f)),
                               LookFrom({3, 4, 1}, 0.0, M_PI / 4), PixelRays(camera));
  EXPECT_EQ(cloud.foot, Eigen::Vector2d(3, 4));
  EXPECT_EQ(cloud.height_of_camera, 1.0f);
  EXPECT_LT((cloud.upright(4) - Eigen::Vector3f(1, 0, 0)).norm(), 1e-6f);
}

// The camera is level, 1 m up, and faces the y axis. The pixel's ray falls 0.5 m and goes 0.25 m to
// the left for each metre ahead.
TEST(OrganisedCloudTest, PixelsRightOfTheAxisLieToTheRight) {
  const CameraModel camera{5, 5, 4.0, 2.0, 2.0, 2.0};
  const auto cloud = MakeCloud(OnePixel(camera, 1, 3, 2.0f), LookFrom({-7, 2, 1}, M_PI / 2, 0.0),
                               PixelRays(camera));
  EXPECT_LT((cloud.upright(16) - Eigen::Vector3f(-0.5f, 2, 0)).norm(), 1e-6f);
}

TEST(OrganisedCloudTest, MovingIsMakingFromTheOtherPose) {
  const BoxScene scene{true, {{{1.5, -0.5, 0}, {2, 0.5, 0.6}}}};
  const auto shot = Photograph(scene, TestCamera(40), LookFrom({0, 0, 1.2}, 0.1, 0.4));
  const Eigen::Isometry3d other = LookFrom({-3, 8, 0.9}, 2.0, 0.3);
  OrganisedCloud moved = shot.Cloud();
  MoveCloud(other, &moved);
  const OrganisedCloud made = shot.CloudAt(other);
  EXPECT_EQ(moved.foot, made.foot);
  EXPECT_EQ(moved.height_of_camera, made.height_of_camera);
  EXPECT_EQ(moved.camera, made.camera);
  EXPECT_EQ(moved.upright_from_camera, made.upright_from_camera);
}

// The iteration that inverts the lens diverges, or the ray is almost across the optical axis.
TEST(PixelRaysTest, PixelsWithoutARayHaveNoReturn) {
  CameraModel tangential = TestCamera(32);
  tangential.distortion = {0.0, 0.0, 1e6, -1e6, 0.0};
  CameraModel wide = TestCamera(32);
  wide.fx = 1.0;
  wide.cx = -1e6;
  for (const CameraModel& camera : {tangential, wide}) {
    const auto rays = PixelRays(camera);
    ASSERT_EQ(rays.size(), 32u * 24u);
    DepthImage depth{32, 24, std::vector<float>(rays.size(), 1.0f)};
    const OrganisedCloud cloud = MakeCloud(depth, Eigen::Isometry3d::Identity(), rays);
    int without_ray = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
      const bool has_ray = rays[i].allFinite();
      without_ray += !has_ray;
      EXPECT_EQ(cloud.valid(static_cast<int32_t>(i)), has_ray);
      EXPECT_TRUE(cloud.camera[i].allFinite());
    }
    EXPECT_GT(without_ray, 0);
  }
}

}  // namespace
}  // namespace hypermap::ingest
