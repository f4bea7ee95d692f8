#include "ingest/perception/ground_plane.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "ingest/perception/testing/box_scene.h"
#include "tests/support/random_map.h"

namespace hypermap::ingest {
namespace {

using testing::BoxScene;
using testing::LookFrom;
using testing::Photograph;
using testing::Shot;
using testing::TestCamera;

constexpr double kDegree = M_PI / 180.0;

// A desk, a bin and a low step on a floor.
BoxScene Office() {
  return {true,
          {{{2.0, -1.5, 0.7}, {2.8, -0.2, 0.74}},
           {{1.6, 0.3, 0.0}, {1.9, 0.6, 0.4}},
           {{2.4, 0.4, 0.0}, {3.0, 1.4, 0.06}}}};
}

double AngleBetween(const GroundPlane& a, const GroundPlane& b) {
  return std::atan2(a.up.cross(b.up).norm(), a.up.dot(b.up));
}

std::optional<GroundPlane> Measured(const Shot& shot, const GroundPlane& claimed) {
  return MeasuredGround(shot.depth, PixelRays(shot.camera), claimed);
}

TEST(GroundPlaneTest, TiltAndHeightAreMeasured) {
  for (const double down : {0.2, 0.35, 0.7}) {
    const Shot shot =
        Photograph(Office(), TestCamera(320), LookFrom({0.1, 0.2, 1.1}, 0.1, down), 61);
    const auto measured =
        Measured(shot, ClaimedGround(LookFrom({0.0, 0.0, 1.12}, 0.4, down + 0.8 * kDegree)));
    ASSERT_TRUE(measured) << down;
    const GroundPlane truth = ClaimedGround(shot.pose);
    EXPECT_LT(AngleBetween(*measured, truth), 0.1 * kDegree) << down;
    EXPECT_NEAR(measured->height_m, truth.height_m, 0.004) << down;
    EXPECT_NEAR(measured->up.norm(), 1.0, 1e-12);
  }
}

TEST(GroundPlaneTest, ClaimsThatDifferGiveTheSameBits) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  hypermap::testing::Rng rng(seed);
  for (int scene = 0; scene < 5; ++scene) {
    const double down = hypermap::testing::Uniform(rng, 0.2, 0.7);
    const Shot shot = Photograph(Office(), TestCamera(160), LookFrom({0, 0, 1.1}, 0.0, down),
                                 hypermap::testing::UniformInt(rng, 1, 1'000'000));
    const auto first = Measured(shot, ClaimedGround(shot.pose));
    ASSERT_TRUE(first);
    for (int claim = 0; claim < 20; ++claim) {
      const auto error = [&](double most) { return hypermap::testing::Uniform(rng, -most, most); };
      Eigen::Isometry3d pose =
          LookFrom({error(9), error(9), 1.1 + error(0.02)}, error(3), down + error(kDegree));
      pose.rotate(Eigen::AngleAxisd(error(kDegree), Eigen::Vector3d::UnitZ()));
      const auto measured = Measured(shot, ClaimedGround(pose));
      ASSERT_TRUE(measured);
      EXPECT_EQ(measured->up, first->up);
      EXPECT_EQ(measured->height_m, first->height_m);
    }
  }
}

TEST(GroundPlaneTest, OtherPlanesAreNoFloor) {
  const Eigen::Isometry3d pose = LookFrom({0, 0, 1.1}, 0.0, 0.35);
  const GroundPlane claimed = ClaimedGround(pose);
  const auto measured = [&](const BoxScene& scene) {
    return Measured(Photograph(scene, TestCamera(160), pose, 62), claimed);
  };
  EXPECT_TRUE(measured({}));
  EXPECT_FALSE(measured({false, {}}));
  EXPECT_FALSE(measured({true, {{{0.5, -9, -1}, {0.6, 9, 3}}}})) << "a wall before the camera";
  EXPECT_FALSE(measured({true, {{{0.2, -9, 0}, {9, 9, 0.1}}}})) << "a stage of 10 cm";
  // A tilt or height that can't be an error of the mounting.
  const Shot shot = Photograph({}, TestCamera(160), pose, 62);
  EXPECT_FALSE(Measured(shot, ClaimedGround(LookFrom({0, 0, 1.1}, 0.0, 0.35 + 3 * kDegree))));
  EXPECT_FALSE(Measured(shot, ClaimedGround(LookFrom({0, 0, 1.17}, 0.0, 0.35))));
  EXPECT_FALSE(Measured(shot, {-Eigen::Vector3d::UnitY(), -1.0}));
  EXPECT_FALSE(Measured(shot, {-Eigen::Vector3d::UnitY(), 1e9}));
}

TEST(GroundPlaneTest, WithoutFloorTheClaimIsRounded) {
  const auto ground = [&](const GroundPlane& claimed) {
    const Shot shot = Photograph({false, {}}, TestCamera(32), LookFrom({0, 0, 1}, 0, 0));
    return GroundOf(shot.depth, PixelRays(shot.camera), claimed);
  };
  const GroundPlane nominal = ClaimedGround(LookFrom({0, 0, 1.1}, 0.0, 18.0 * kDegree));
  for (const double error : {-1.0, 0.0, 1.0}) {
    Eigen::Isometry3d pose =
        LookFrom({0, 0, 1.1 + 0.004 * error}, 2.0, (18.0 + 0.4 * error) * kDegree);
    pose.rotate(Eigen::AngleAxisd(0.4 * error * kDegree, Eigen::Vector3d::UnitZ()));
    const GroundPlane rounded = ground(ClaimedGround(pose));
    EXPECT_LT(AngleBetween(rounded, nominal), 1e-9);
    EXPECT_NEAR(rounded.height_m, 1.1, 1e-12);
  }
  // The direction of a view that looks down hardly agrees with a rounded tilt.
  const GroundPlane down = ClaimedGround(LookFrom({0, 0, 1.1003}, 0.0, 70.3 * kDegree));
  EXPECT_EQ(ground(down).up, down.up);
  EXPECT_EQ(ground(down).height_m, down.height_m);
}

}  // namespace
}  // namespace hypermap::ingest
