#include "ingest/perception/weight.h"

#include "gtest/gtest.h"
#include "ingest/perception/testing/box_scene.h"

namespace hypermap::ingest {
namespace {

using testing::Mask;
using testing::Rectangle;
using testing::TestCamera;

// A depth image with everything `metres` away.
DepthImage Flat(const CameraModel& camera, float metres) {
  return {camera.width, camera.height,
          std::vector<float>(static_cast<size_t>(camera.width) * camera.height, metres)};
}

double TruncationOf(const CameraModel& camera, const DepthImage& depth, const Mask& mask) {
  return Truncation(MakeCloud(depth, Eigen::Isometry3d::Identity(), PixelRays(camera)), mask);
}

// An image of 40 x 30 pixels with everything at 2 m, except columns u_begin <= u < u_end.
DepthImage WithStrip(int u_begin, int u_end, float metres) {
  DepthImage depth = Flat(TestCamera(40), 2.0f);
  for (int v = 0; v < 30; ++v) {
    for (int u = u_begin; u < u_end; ++u) depth.metres[v * 40 + u] = metres;
  }
  return depth;
}

TEST(WeightTest, FallsWithRangeAndTruncation) {
  EXPECT_DOUBLE_EQ(Weight(0.0, 0.0), 1.0);
  EXPECT_DOUBLE_EQ(Weight(1.8, 0.0), 0.5);
  EXPECT_DOUBLE_EQ(Weight(3.6, 0.0), 1.0 / 17.0);
  EXPECT_DOUBLE_EQ(Weight(0.0, 0.1), 0.8);
  EXPECT_DOUBLE_EQ(Weight(0.0, 0.2), 0.6);
  EXPECT_DOUBLE_EQ(Weight(0.0, 1.0), 0.6);
  EXPECT_DOUBLE_EQ(Weight(1.8, 0.5), 0.3);
}

TEST(TruncationTest, NoneInTheMiddleOfTheImage) {
  const CameraModel camera = TestCamera(40);
  const Mask mask = Rectangle(40, 30, 10, 10, 20, 20);
  EXPECT_EQ(TruncationOf(camera, Flat(camera, 2.0f), mask), 0.0);
  EXPECT_EQ(TruncationOf(camera, WithStrip(20, 40, 5.0f), mask), 0.0);   // Before a far surface.
  EXPECT_EQ(TruncationOf(camera, WithStrip(20, 40, 0.0f), mask), 0.0);   // Beside no return.
  EXPECT_EQ(TruncationOf(camera, WithStrip(20, 40, 1.96f), mask), 0.0);  // Within depth noise.
}

// One side of a square mask lies at the edge of the image, then two.
TEST(TruncationTest, IsTheShareOfTheBorderAtTheImagesEdge) {
  const CameraModel camera = TestCamera(40);
  const DepthImage depth = Flat(camera, 2.0f);
  EXPECT_DOUBLE_EQ(TruncationOf(camera, depth, Rectangle(40, 30, 0, 10, 10, 20)), 0.25);
  EXPECT_DOUBLE_EQ(TruncationOf(camera, depth, Rectangle(40, 30, 10, 20, 20, 30)), 0.25);
  EXPECT_DOUBLE_EQ(TruncationOf(camera, depth, Rectangle(40, 30, 30, 20, 40, 30)), 0.5);
}

TEST(TruncationTest, IsTheShareOfTheBorderBehindSomethingNearer) {
  EXPECT_DOUBLE_EQ(
      TruncationOf(TestCamera(40), WithStrip(20, 24, 1.0f), Rectangle(40, 30, 10, 10, 20, 20)),
      0.25);
}

// Wherever a thinned mask begins and ends, only its border at the edge of the image counts.
TEST(TruncationTest, OfLargeMasksIsThatOfSmallOnes) {
  const CameraModel camera = TestCamera(320);
  const OrganisedCloud cloud =
      MakeCloud(Flat(camera, 2.0f), Eigen::Isometry3d::Identity(), PixelRays(camera));
  for (const int width : {100, 101, 140, 141, 142}) {
    for (const int height : {100, 101, 140, 141, 142}) {
      const Mask middle = Rectangle(320, 240, 51, 51, 51 + width, 51 + height);
      EXPECT_EQ(Truncation(cloud, middle), 0.0) << width << " x " << height;
      const Mask right = Rectangle(320, 240, 320 - width, 51, 320, 51 + height);
      const double share = height / (2.0 * (width + height));
      EXPECT_NEAR(Truncation(cloud, right), share, 0.01) << width << " x " << height;
    }
  }
}

TEST(TruncationTest, EmptyMaskHasNone) {
  const CameraModel camera = TestCamera(40);
  EXPECT_EQ(TruncationOf(camera, Flat(camera, 2.0f), Mask(1200, 0)), 0.0);
}

}  // namespace
}  // namespace hypermap::ingest
