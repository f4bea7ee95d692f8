#include "simulation/worlds/sequence_files.h"

#include <nlohmann/json.hpp>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "ingest/sources/depth_png.h"
#include "ingest/sources/mask.h"
#include "ingest/sources/trajectory.h"

namespace hypermap::simulation {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(SequenceFilesTest, DepthIsReadBackByTheWorkersReader) {
  const ingest::DepthImage depth{3, 2, {0.0f, 0.4f, 1.2346f, 7.9998f, 99.0f, 2.0f}};
  const auto png = EncodeDepthPng(depth);
  ASSERT_TRUE(png.ok()) << png.status();
  const auto read = ingest::DecodeDepthPng(*png, 3, 2, 5000.0);
  ASSERT_TRUE(read.ok()) << read.status();
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(read->metres[i], i == 4 ? 65535 / 5000.0 : depth.metres[i], 1e-4);
  }
}

TEST(SequenceFilesTest, MasksAreReadBackByTheWorkersReader) {
  Random random(2);
  std::vector<uint8_t> mask(320 * 240);
  for (size_t i = 0; i < mask.size(); ++i) mask[i] = i == 0 || random.Chance(0.1);
  const ingest::CameraModel camera{320, 240, 262.5, 262.5, 159.5, 119.5};
  const json coco = json::parse(EncodeDetections(
      {absl::FromUnixSeconds(5), absl::FromUnixSeconds(6)}, camera, {{}, {{"cup", 0.5, mask}}}));
  ASSERT_EQ(coco["images"].size(), 2u);
  EXPECT_EQ(coco["images"][0]["file_name"], "depth/5.000000.png");
  const json& annotation = coco["annotations"][0];
  EXPECT_EQ(annotation["image_id"], 2);
  EXPECT_EQ(annotation["score"], 0.5);
  EXPECT_EQ(coco["categories"][0], (json{{"id", annotation["category_id"]}, {"name", "cup"}}));
  const ingest::MaskRuns runs{320, 240, annotation["segmentation"]["counts"]};
  const auto read = ingest::DecodeMask(runs, 320, 240);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(*read, mask);
}

TEST(SequenceFilesTest, TheTruthIsWhatStandsThere) {
  const Scene scene = MakeOffice(1);
  std::vector<Sightings> sightings(scene.bodies.size(), {9, 500});
  const json truth = json::parse(EncodeTruth(scene, sightings));
  ASSERT_EQ(truth["features"].size(), scene.bodies.size());
  EXPECT_EQ(truth["properties"]["frame"], "map");
  const json& first = truth["features"][0];
  EXPECT_EQ(first["properties"]["label"], scene.bodies[0].label);
  EXPECT_EQ(first["properties"]["visible_frames"], 9);
  const json& ring = first["geometry"]["coordinates"][0];
  EXPECT_EQ(ring.front(), ring.back());
}

// With cells of 5 cm the outer wall is two cells thick. The path is free.
TEST(SequenceFilesTest, TheFloorPlanHasWallsAndFreeFloor) {
  const Scene scene = MakeOffice(1);
  const FloorPlanFiles plan = EncodeFloorPlan(scene);
  EXPECT_THAT(plan.yaml, HasSubstr("origin: [-0.1, -0.1, 0.0]"));
  ASSERT_THAT(plan.pgm, StartsWith("P5\n236 112\n255\n"));
  const std::string cells = plan.pgm.substr(plan.pgm.size() - 236 * 112);
  const auto at = [&cells](const Point& p) {
    const int column = static_cast<int>((p.x + 0.1) / 0.05),
              row = static_cast<int>((p.y + 0.1) / 0.05);
    return static_cast<uint8_t>(cells[(111 - row) * 236 + column]);
  };
  EXPECT_EQ(at({-0.05, 2.0}), 0);
  EXPECT_EQ(at({6.25, 1.0}), 0);
  for (const Point& p : scene.path) EXPECT_EQ(at(p), 254);
}

// The quaternion of a level camera has components of +-0.5; tilted by 18 degrees they are
// +-(cos 9 +- sin 9) / 2.
TEST(SequenceFilesTest, TrajectoriesHaveALineForEachPose) {
  EXPECT_EQ(
      EncodeTrajectory({absl::FromUnixSeconds(5)}, {PlanarTransform(1, 2, 0)}, {0.06, 0.05, 0.016}),
      "# camera trajectory, optical frame in the frame map\n"
      "# pose_sigma: 0.06,0.05,0.016\n"
      "# timestamp tx ty tz qx qy qz qw\n"
      "5.000000 1.00000 2.00000 1.10000 0.572061 -0.572061 0.415627 -0.415627\n");
}

TEST(SequenceFilesTest, TheSigmaIsReadBackByTheWorkersReader) {
  const auto trajectory = ingest::Trajectory::Parse(EncodeTrajectory(
      {absl::FromUnixSeconds(5)}, {PlanarTransform(1, 2, 0)}, ingest::kLocalisationSigma));
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  EXPECT_EQ(trajectory->pose_sigma(), ingest::kLocalisationSigma);
}

}  // namespace
}  // namespace hypermap::simulation
