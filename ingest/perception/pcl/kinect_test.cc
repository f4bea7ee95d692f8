// Background removal on real Kinect frames, with the mask of each object grown by 8 pixels.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "absl/time/clock.h"
#include "ingest/perception/pcl/region_growing_segmenter.h"
#include "ingest/perception/pcl/testing/kinect_frames.h"

namespace hypermap::ingest {
namespace {

constexpr int kGrow_px = 8;

std::string DataFolder() {
  const char* data = std::getenv("HYPERMAP_DATA");
  return data != nullptr ? data : HYPERMAP_SOURCE_DIR "/../shared/data";
}

struct Result {
  Removal sum;
  absl::Duration time;
};

Result MeasureAll(const char* name, const Segmenter& segmenter,
                  const std::vector<KinectFrame>& frames, Growth growth) {
  Result result;
  int objects = 0;
  for (const KinectFrame& frame : frames) {
    for (int object = 2; object < frame.num_objects + 2; ++object) {
      const std::vector<uint8_t> mask = GrownMask(frame, object, kGrow_px, growth);
      const absl::Time begin = absl::Now();
      const Removal one = Measure(segmenter, frame, object, mask);
      result.time += absl::Now() - begin;
      if (one.object == 0) continue;
      ++objects;
      std::printf(
          "  %-10s %-8s object %2d: %6lld points, background kept %5.1f %%, lost %5.1f %%\n", name,
          frame.name.c_str(), object, static_cast<long long>(one.object), 100 * one.kept_share(),
          100 * one.lost_share());
      result.sum += one;
    }
  }
  std::printf(
      "%-10s %s: background kept %.2f %% (of the table %.2f %%), object lost %.2f %%, "
      "%.1f ms an object (%d)\n",
      name, growth == Growth::kSquare ? "square" : "disc", 100 * result.sum.kept_share(),
      100 * result.sum.table_kept_share(), 100 * result.sum.lost_share(),
      absl::ToDoubleMilliseconds(result.time) / objects, objects);
  return result;
}

class KinectTest : public testing::TestWithParam<Growth> {};

TEST_P(KinectTest, TheDefaultSegmenterRemovesBackgroundAndKeepsTheObject) {
  const std::vector<KinectFrame> frames = LoadKinectFrames(DataFolder() + "/kinect");
  if (frames.empty()) GTEST_SKIP() << "no Kinect frames in " << DataFolder();
  const Removal organised =
      MeasureAll("organised", *MakeOrganisedSegmenter(), frames, GetParam()).sum;
  const Removal growing =
      MeasureAll("growing", *MakeRegionGrowingSegmenter(), frames, GetParam()).sum;
  EXPECT_LE(organised.kept_share(), 0.03);
  EXPECT_LE(organised.lost_share(), 0.05);
  EXPECT_LE(organised.kept_share(), growing.kept_share());
  EXPECT_LE(organised.lost_share(), growing.lost_share());
}

INSTANTIATE_TEST_SUITE_P(Growths, KinectTest, testing::Values(Growth::kSquare, Growth::kDisc));

}  // namespace
}  // namespace hypermap::ingest
