#include "ingest/perception/smoothing.h"

#include <cmath>

#include "gtest/gtest.h"
#include "ingest/perception/depth_noise.h"
#include "tests/support/random_map.h"

namespace hypermap::ingest {
namespace {

using hypermap::testing::Rng;
using hypermap::testing::TestSeed;
using hypermap::testing::Uniform;
using hypermap::testing::UniformInt;

OrganisedCloud Noisy(Rng& rng, int width, int height) {
  OrganisedCloud cloud;
  cloud.width = width;
  cloud.height = height;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const auto z = static_cast<float>((u > width / 2 ? 1.0 : 2.0) + Uniform(rng, -0.01, 0.01));
      cloud.camera.emplace_back(0.01f * static_cast<float>(u) * z,
                                0.01f * static_cast<float>(v) * z, z);
    }
  }
  return cloud;
}

// Smooths pixel by pixel, as the header defines it.
std::vector<Eigen::Vector3f> Expected(const OrganisedCloud& cloud,
                                      const std::vector<int32_t>& pixels, int stride) {
  std::vector<Eigen::Vector3f> points;
  for (const int32_t pixel : pixels) {
    if (pixel % cloud.width % stride != 0 || pixel / cloud.width % stride != 0) continue;
    const float z = cloud.camera[pixel].z();
    float sum = 0.0f;
    float count = 0.0f;
    for (const int32_t other : pixels) {
      if (std::abs(pixel % cloud.width - other % cloud.width) > 2) continue;
      if (std::abs(pixel / cloud.width - other / cloud.width) > 2) continue;
      const float dz = cloud.camera[other].z() - z;
      if (std::abs(dz) > 3.0f * DepthSigma(z) + 0.005f) continue;
      sum += dz;
      count += 1.0f;
    }
    points.emplace_back(cloud.camera[pixel] * (1.0f + sum / count / z));
  }
  return points;
}

TEST(SmoothingTest, IsTheMeanOverNeighboursOnTheSameSurface) {
  Rng rng(TestSeed());
  for (int round = 0; round < 60; ++round) {
    const OrganisedCloud cloud = Noisy(rng, UniformInt(rng, 1, 40), UniformInt(rng, 1, 30));
    std::vector<int32_t> pixels;
    for (int i = 0; i < cloud.width * cloud.height; ++i) {
      if (UniformInt(rng, 0, 9) < 6) pixels.push_back(i);
    }
    for (const int stride : {1, 2, 3, 5}) {
      const auto found = SmoothedFromCamera(cloud, pixels, stride);
      const auto expected = Expected(cloud, pixels, stride);
      ASSERT_EQ(found.size(), expected.size());
      for (size_t i = 0; i < found.size(); ++i) {
        ASSERT_LT((found[i] - expected[i]).norm(), 1e-5f) << "stride " << stride << ", " << i;
      }
    }
  }
}

TEST(SmoothingTest, LiesAlongTheAxesOfTheFrame) {
  OrganisedCloud cloud;
  cloud.width = cloud.height = 1;
  cloud.camera = {{0.0f, 0.0f, 2.0f}};
  cloud.height_of_camera = 5.0f;
  cloud.upright_from_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const auto points = SmoothedFromCamera(cloud, {0}, 1);
  ASSERT_EQ(points.size(), 1u);
  EXPECT_EQ(points[0], Eigen::Vector3f(2, 0, 0));
}

TEST(SmoothingTest, NoPixelsAreNoPoints) {
  EXPECT_TRUE(SmoothedFromCamera(OrganisedCloud{}, {}, 1).empty());
}

}  // namespace
}  // namespace hypermap::ingest
