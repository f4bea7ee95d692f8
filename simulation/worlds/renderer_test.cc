#include "simulation/worlds/renderer.h"

#include <cmath>

#include "gtest/gtest.h"
#include "simulation/worlds/drive.h"
#include "simulation/worlds/testing/camera.h"

namespace hypermap::simulation {
namespace {

Prism Block(double x0, double y0, double x1, double y1, double low_m, double high_m) {
  return {{{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}, low_m, high_m};
}

// The camera is at the origin, level, and looks along x.
Eigen::Isometry3d Level(double height_m) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  pose.translation() = Eigen::Vector3d(0, 0, height_m);
  return pose;
}

// A wall is 3 m ahead and the floor 1 m below, so that row v sees the floor at fy / (v - cy) m.
TEST(RendererTest, DepthsAreThoseOfThePinhole) {
  const Scene scene{{}, {Block(-1, -9, 9, 9, -0.1, 0), Block(3, -9, 3.2, 9, 0, 9)}, {}, {}};
  const View view = Render(scene, Camera(), Level(1.0));
  for (const int u : {0, 17, 160, 319}) {
    EXPECT_FLOAT_EQ(view.depth.at(u, 0), 3.0f);
    EXPECT_FLOAT_EQ(view.depth.at(u, 119), 3.0f);
    EXPECT_FLOAT_EQ(view.depth.at(u, 206), 3.0f);  // 262.5 / 86.5 = 3.03; the wall is nearer.
    EXPECT_FLOAT_EQ(view.depth.at(u, 208), 262.5f / 88.5f);
    EXPECT_FLOAT_EQ(view.depth.at(u, 239), 262.5f / 119.5f);
  }
}

// A box half a metre wide at 2 m is 0.5 * 262.5 / 2 = 65.6 pixels wide. It hides the box behind.
TEST(RendererTest, WhatStandsBeforeHidesWhatStandsBehind) {
  const Scene scene{{},
                    {},
                    {{"near", {Block(2.0, -0.25, 2.5, 0.25, 0.5, 1.5)}},
                     {"behind", {Block(3.0, -0.2, 3.5, 0.2, 0.6, 1.4)}},
                     {"beside", {Block(3.0, 0.6, 3.5, 0.8, 0.5, 1.5)}}},
                    {}};
  const View view = Render(scene, Camera(), Level(1.0));
  int width = 0;
  for (int u = 0; u < 320; ++u) width += view.body_at(u, 120) == 0;
  EXPECT_NEAR(width, 65.6, 1.0);
  EXPECT_EQ(view.body_at(160, 120), 0);
  EXPECT_FLOAT_EQ(view.depth.at(160, 120), 2.0f);
  for (const int16_t body : view.body) EXPECT_NE(body, 1);
  // y = 0.7 m is to the left of the centre, at column 159.5 - 0.7 / 3 * 262.5 for 3 m.
  EXPECT_EQ(view.body_at(98, 120), 2);
  EXPECT_EQ(view.body_at(0, 0), View::kStructure);
  EXPECT_EQ(view.depth.at(0, 0), 0.0f);
}

TEST(RendererTest, ThingsThatReachBehindTheCameraAreSeen) {
  const Scene scene{{}, {}, {{"rail", {Block(-5, -1.2, 5, -1.0, 0.9, 1.1)}}}, {}};
  const View view = Render(scene, Camera(), Level(1.0));
  EXPECT_EQ(view.body_at(319, 119), 0);
  EXPECT_NEAR(view.depth.at(319, 119), 262.5 / 159.5, 1e-3);
}

TEST(RendererTest, NoiseGrowsWithTheSquareOfTheDistance) {
  Random random(1);
  for (const double z : {1.0, 4.0}) {
    const Scene scene{{}, {Block(z, -99, z + 1, 99, -99, 99)}, {}, {}};
    const ingest::DepthImage noisy = WithSensorNoise(Render(scene, Camera(), Level(1.0)), random);
    double sum = 0, squares = 0;
    for (const float d : noisy.metres) {
      sum += d - z;
      squares += (d - z) * (d - z);
    }
    const double n = static_cast<double>(noisy.metres.size());
    // Rounding to steps of s adds a variance of s^2 / 12.
    const double sigma = std::hypot(1.425e-3, 2.85e-3 / std::sqrt(12.0)) * z * z;
    EXPECT_NEAR(sum / n, 0.0, 0.2 * sigma);
    EXPECT_NEAR(std::sqrt(squares / n), sigma, 0.1 * sigma);
  }
}

TEST(RendererTest, NothingIsMeasuredOutOfRange) {
  Random random(1);
  for (const double z : {0.3, 8.5}) {
    const Scene scene{{}, {Block(z, -99, z + 1, 99, -99, 99)}, {}, {}};
    for (const float d : WithSensorNoise(Render(scene, Camera(), Level(1.0)), random).metres) {
      ASSERT_EQ(d, 0.0f);
    }
  }
}

}  // namespace
}  // namespace hypermap::simulation
