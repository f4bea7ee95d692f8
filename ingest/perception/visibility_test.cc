#include "ingest/perception/visibility.h"

#include <cmath>
#include <limits>

#include "gtest/gtest.h"
#include "ingest/perception/testing/box_scene.h"
#include "map/geometry/predicates.h"

namespace hypermap::ingest {
namespace {

using testing::BoxScene;
using testing::LookFrom;
using testing::Mask;
using testing::Photograph;
using testing::Rectangle;
using testing::Shot;
using testing::TestCamera;

// The camera is 1 m up, looks 30 degrees down and has a vertical field of view of 49 degrees, so
// that it sees the floor from 1 / tan(54.5 degrees) = 0.71 m on.
Shot Look(const BoxScene& scene) {
  return Photograph(scene, TestCamera(160), LookFrom({10, 20, 1.0}, 0.0, M_PI / 6));
}

// A crate half a metre high, 2 m ahead.
BoxScene Crate() { return {true, {{{12.0, 19.7, 0.0}, {12.3, 20.3, 0.5}}}}; }

TEST(FreeSpaceTest, GoesFromTheNearestFloorSeenToWhatStandsThere) {
  const Polygon space = FreeSpace(Look(Crate()).Cloud(), {});
  EXPECT_FALSE(Covers(space, {10.5, 20.0}));  // Below the image.
  EXPECT_TRUE(Covers(space, {10.8, 20.0}));
  EXPECT_TRUE(Covers(space, {11.9, 20.0}));
  EXPECT_FALSE(Covers(space, {12.1, 20.0}));
  EXPECT_FALSE(Covers(space, {13.0, 20.0}));  // Behind the crate.
  EXPECT_FALSE(Covers(space, {16.0, 20.0}));  // Behind the crate, but visible above it.
  EXPECT_TRUE(Covers(space, {13.0, 21.2}));   // Beside the crate.
  EXPECT_TRUE(Covers(space, {13.0, 18.8}));
  EXPECT_FALSE(Covers(space, {12.0, 22.0}));  // Left of the image.
  EXPECT_FALSE(Covers(space, {9.0, 20.0}));   // Behind the camera.
}

TEST(FreeSpaceTest, EndsAtTheWall) {
  const Polygon space = FreeSpace(Look({true, {{{13, 10, 0}, {13.2, 30, 2.5}}}}).Cloud(), {});
  ASSERT_FALSE(space.empty());
  EXPECT_LT(space.bounds().max.x, 13.05);
  EXPECT_TRUE(Covers(space, {12.9, 20.0}));
}

TEST(FreeSpaceTest, LowSillsDoNotStandInTheWay) {
  EXPECT_TRUE(
      Covers(FreeSpace(Look({true, {{{12, 15, 0}, {12.1, 25, 0.09}}}}).Cloud(), {}), {13.0, 20.0}));
  EXPECT_FALSE(
      Covers(FreeSpace(Look({true, {{{12, 15, 0}, {12.1, 25, 0.20}}}}).Cloud(), {}), {13.0, 20.0}));
}

TEST(FreeSpaceTest, EndsAtTheRange) {
  const OrganisedCloud cloud = Look({}).Cloud();
  EXPECT_TRUE(Covers(FreeSpace(cloud, {}), {14.0, 20.0}));
  const Polygon near = FreeSpace(cloud, {.max_range_m = 3.0f});
  EXPECT_TRUE(Covers(near, {12.8, 20.0}));
  EXPECT_LT(near.bounds().max.x, 13.01);
}

TEST(FreeSpaceTest, WithoutFloorOrReturnsThereIsNone) {
  Shot shot = Photograph({false, {{{12, 10, 0}, {12.2, 30, 2.5}}}}, TestCamera(160),
                         LookFrom({10, 20, 1.0}, 0.0, 0.0));
  EXPECT_TRUE(FreeSpace(shot.Cloud(), {}).empty());
  shot.depth.metres.assign(shot.depth.metres.size(), 0.0f);
  EXPECT_TRUE(FreeSpace(shot.Cloud(), {}).empty());
}

// Unlike the free space, the hull contains places that are hidden.
TEST(ViewHullTest, HoldsTheHiddenPlace) {
  const Polygon hull = ViewHull(Look(Crate()).Cloud(), {});
  EXPECT_TRUE(Covers(hull, {11.0, 20.0}));
  EXPECT_TRUE(Covers(hull, {13.0, 20.0}));
  EXPECT_FALSE(Covers(hull, {12.0, 22.0}));
  EXPECT_FALSE(Covers(hull, {9.0, 20.0}));
}

TEST(ViewHullTest, WithoutReturnsThereIsNone) {
  Shot shot = Look({});
  shot.depth.metres.assign(shot.depth.metres.size(), 0.0f);
  EXPECT_TRUE(ViewHull(shot.Cloud(), {}).empty());
}

TEST(ThinnedDepthTest, PixelsLookAlongTheRaysOfTheImagesPixels) {
  CameraModel camera{33, 21, 27.0, 26.0, 15.7, 10.1};
  DepthImage depth{33, 21, {}};
  for (int i = 0; i < 33 * 21; ++i) depth.metres.push_back(0.5f + 0.004f * i);
  const auto rays = PixelRays(camera);
  const OrganisedCloud cloud = MakeCloud(depth, Eigen::Isometry3d::Identity(), rays);
  const DepthView view = ThinnedDepth(cloud, camera, 4, {});
  ASSERT_EQ(view.columns, 8);  // Pixels 2, 6, ..., 30.
  ASSERT_EQ(view.rows, 5);     // Pixels 2, 6, ..., 18.
  ASSERT_EQ(view.depth_mm.size(), 40u);
  for (int r = 0; r < view.rows; ++r) {
    for (int c = 0; c < view.columns; ++c) {
      const int pixel = (4 * r + 2) * 33 + 4 * c + 2;
      EXPECT_NEAR((c - view.cx) / view.fx, rays[pixel].x(), 1e-6);
      EXPECT_NEAR((r - view.cy) / view.fy, rays[pixel].y(), 1e-6);
      EXPECT_NEAR(view.depth_mm[r * view.columns + c], 1000.0f * depth.metres[pixel], 0.51f);
    }
  }
}

// On a slanted wall depth follows from the ray. The left half of the wall is in the mask.
TEST(ThinnedDepthTest, LensIsUndone) {
  const CameraModel camera{320, 240, 262.5, 262.5, 159.5, 119.5, {-0.3, 0.1, 0.0, 0.0, 0.0}};
  const auto metres = [](double x, double y) { return 1.0 / (0.5 + 0.2 * x - 0.1 * y); };
  const auto rays = PixelRays(camera);
  DepthImage depth{320, 240, {}};
  Mask left;
  for (const auto& ray : rays) {
    depth.metres.push_back(static_cast<float>(metres(ray.x(), ray.y())));
    left.push_back(ray.x() < -0.3f);
  }
  const auto cloud = MakeCloud(depth, Eigen::Isometry3d::Identity(), rays);
  const DepthView view = ThinnedDepth(cloud, camera, 4, {&left});
  for (int r = 0; r < view.rows; ++r) {
    for (int c = 0; c < view.columns; ++c) {
      const double x = (c - view.cx) / view.fx;
      const double y = (r - view.cy) / view.fy;
      EXPECT_NEAR(view.depth_mm[r * view.columns + c], 1000.0 * metres(x, y), 8.0)
          << x << ", " << y;
      if (std::abs(x + 0.3) < 0.005) continue;
      EXPECT_EQ(view.owner[r * view.columns + c], x < -0.3) << x;
    }
  }
}

TEST(ThinnedDepthTest, NoDepthBeyondTheImageOfACushionLens) {
  const CameraModel camera{320, 240, 262.5, 262.5, 159.5, 119.5, {0.3, 0.0, 0.0, 0.0, 0.0}};
  const DepthImage depth{320, 240, std::vector<float>(320 * 240, 2.0f)};
  const auto cloud = MakeCloud(depth, Eigen::Isometry3d::Identity(), PixelRays(camera));
  const DepthView view = ThinnedDepth(cloud, camera, 4, {});
  EXPECT_EQ(view.depth_mm.front(), 0);
  EXPECT_EQ(view.depth_mm[30 * 80 + 40], 2000);
}

TEST(ThinnedDepthTest, DepthIsNoneWithoutReturnAndEndsAtTheLastMillimetre) {
  const CameraModel camera = TestCamera(4);
  DepthImage depth{4, 3, std::vector<float>(12, 0.0f)};
  depth.metres[1] = 1e6f;
  const auto cloud = MakeCloud(depth, Eigen::Isometry3d::Identity(), PixelRays(camera));
  const DepthView view = ThinnedDepth(cloud, camera, 1, {});
  EXPECT_EQ(view.depth_mm[0], 0);
  EXPECT_EQ(view.depth_mm[1], 65535);
}

TEST(ThinnedDepthTest, PixelsKnowWhoseMaskTheyLieIn) {
  const CameraModel camera = TestCamera(16);
  const DepthImage depth{16, 12, std::vector<float>(192, 2.0f)};
  const auto cloud = MakeCloud(depth, Eigen::Isometry3d::Identity(), PixelRays(camera));
  const Mask left = Rectangle(16, 12, 0, 0, 8, 6);
  const Mask middle = Rectangle(16, 12, 4, 0, 12, 6);
  const DepthView view = ThinnedDepth(cloud, camera, 4, {&left, &middle});
  // The view has the columns 2, 6, 10, 14 and the rows 2, 6, 10 of the image.
  constexpr uint8_t kSeveral = DepthView::kSeveral;
  EXPECT_EQ(view.owner, (std::vector<uint8_t>{1, kSeveral, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
}

TEST(ThinnedDepthTest, MasksBeyondThe253rdHaveNoOwnerOfTheirOwn) {
  const CameraModel camera = TestCamera(4);
  const DepthImage depth{4, 3, std::vector<float>(12, 2.0f)};
  const auto cloud = MakeCloud(depth, Eigen::Isometry3d::Identity(), PixelRays(camera));
  const Mask none(12, 0);
  const Mask first = Rectangle(4, 3, 0, 0, 1, 1);
  const Mask second = Rectangle(4, 3, 1, 0, 2, 1);
  std::vector<const Mask*> masks(254, &none);
  masks[252] = &first;
  masks[253] = &second;
  const DepthView view = ThinnedDepth(cloud, camera, 1, masks);
  EXPECT_EQ(view.owner[0], 253);
  EXPECT_EQ(view.owner[1], DepthView::kSeveral);
  EXPECT_EQ(view.owner[2], 0);
}

TEST(VisibilityTest, PointsThatAreNotFiniteAreNotSeen) {
  const Shot shot = Look(Crate());
  for (const float number :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity(), std::numeric_limits<float>::max()}) {
    OrganisedCloud cloud = shot.Cloud();
    OrganisedCloud without = shot.Cloud();
    // Pixels that FreeSpace does not sample for its fan.
    for (size_t i = 2; i < cloud.camera.size(); i += 5) {
      cloud.camera[i].x() = number;
      without.camera[i].setZero();
    }
    EXPECT_EQ(ViewHull(cloud, {}), ViewHull(without, {})) << number;
    EXPECT_EQ(FreeSpace(cloud, {}), FreeSpace(without, {})) << number;
    // A pixel that it samples leaves the fan without a direction.
    cloud.camera[0].x() = cloud.camera[5].x() = number;
    cloud.camera[0].z() = cloud.camera[5].z() = 1.0f;
    const Polygon space = FreeSpace(cloud, {});
    if (space.empty()) continue;
    for (const Point& p : space.outer()) EXPECT_TRUE(IsFinite(p)) << number;
  }
}

// All returns that are sampled for the fan lie in almost one direction, and another far beside it.
TEST(VisibilityTest, AFanAlmostWithoutWidthShowsNoFreeSpace) {
  OrganisedCloud cloud = Look({}).Cloud();
  const Eigen::Vector3f beside = cloud.camera.back();
  const Eigen::Vector3f ahead(0.0f, beside.y(), beside.z());
  for (size_t i = 0; i < cloud.camera.size(); ++i) {
    cloud.camera[i] = ahead + Eigen::Vector3f(i % 2 == 0 ? 1e-9f : 0.0f, 0.0f, 0.0f);
  }
  cloud.camera[1] = beside;
  EXPECT_TRUE(FreeSpace(cloud, {}).empty());
}

}  // namespace
}  // namespace hypermap::ingest
