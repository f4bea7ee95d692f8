#include "map/fusion/depth_lookup.h"

#include "gtest/gtest.h"

namespace hypermap::fusion {
namespace {

// An image of 3 x 1 pixels of a camera at the origin that looks along the frame's third axis: a
// surface of detection 1 at 2 m, no return, and a surface of no detection at 4 m.
DepthView ThreePixels() {
  DepthView view{3, 1, 10.0, 10.0, 1.0, 0.0};
  view.depth_mm = {2000, 0, 4000};
  view.owner = {1, 0, 0};
  return view;
}

TEST(DepthLookupTest, ComparesThePlaceWithTheMeasuredDepth) {
  const DepthView view = ThreePixels();
  const DepthLookup depth(view, Eigen::Isometry3d::Identity(), 0.05);
  const auto at = [&depth](double u, double z) {
    return depth.At(0.1 * (u - 1.0) * z, 0.0, z, nullptr);
  };
  EXPECT_EQ(at(0, 1.5), SpaceState::kEmpty);
  EXPECT_EQ(at(0, 1.97), SpaceState::kSurface);
  EXPECT_EQ(at(0, 2.03), SpaceState::kSurface);
  EXPECT_EQ(at(0, 2.5), SpaceState::kOccluded);
  EXPECT_EQ(at(1, 1.5), SpaceState::kUnseen) << "no return";
  EXPECT_EQ(at(2, 2.5), SpaceState::kEmpty);
  EXPECT_EQ(at(3, 2.5), SpaceState::kUnseen) << "outside the image";
  EXPECT_EQ(at(2, -4.0), SpaceState::kUnseen) << "behind the camera";
}

TEST(DepthLookupTest, NamesTheOwnerOfASurface) {
  const DepthView view = ThreePixels();
  const DepthLookup depth(view, Eigen::Isometry3d::Identity(), 0.05);
  uint8_t owner = 7;
  EXPECT_EQ(depth.At(-0.2, 0.0, 2.0, &owner), SpaceState::kSurface);
  EXPECT_EQ(owner, 1);
  EXPECT_EQ(depth.At(0.4, 0.0, 4.0, &owner), SpaceState::kSurface);
  EXPECT_EQ(owner, 0);
}

}  // namespace
}  // namespace hypermap::fusion
