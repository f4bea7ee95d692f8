#include "ingest/perception/pcl/region_growing_segmenter.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace hypermap::ingest {
namespace {

// PCL's search tree requires finite points.
TEST(RegionGrowingSegmenterTest, PointsThatAreNotFiniteAreInNoRegion) {
  constexpr int kSide = 40;
  OrganisedCloud cloud;
  cloud.width = cloud.height = kSide;
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      cloud.camera.emplace_back(0.01f * static_cast<float>(u), 0.01f * static_cast<float>(v), 1.0f);
    }
  }
  for (size_t i = 0; i < cloud.camera.size(); i += 7) {
    cloud.camera[i].x() = i % 2 == 0 ? std::numeric_limits<float>::quiet_NaN()
                                     : std::numeric_limits<float>::infinity();
  }
  const std::vector<uint8_t> all(cloud.camera.size(), 1);
  const std::vector<int32_t> pixels = MakeRegionGrowingSegmenter()->Segment(cloud, all);
  EXPECT_GT(pixels.size(), 1000u);
  for (const int32_t pixel : pixels) EXPECT_TRUE(cloud.camera[pixel].allFinite());
}

}  // namespace
}  // namespace hypermap::ingest
