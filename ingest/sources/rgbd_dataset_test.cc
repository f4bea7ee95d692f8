#include "ingest/sources/rgbd_dataset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "ingest/sources/input_file.h"
#include "ingest/sources/testing/recording.h"
#include "map/observations/view_frame.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::ingest {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;

constexpr char kCamera[] =
    "image_width: 2\nimage_height: 2\ncamera_matrix: {data: [2, 0, 0.5, 0, 2, 0.5, 0, 0, 1]}\n";

std::string Image(int id, const std::string& file, const std::string& more = "") {
  return absl::StrCat("{\"id\": ", id, ", \"file_name\": \"", file, "\"", more, "}");
}
std::string Coco(const std::string& images) {
  return absl::StrCat("{\"images\": [", images,
                      "], \"categories\": [{\"id\": 1, \"name\": \"cup\"}], \"annotations\": "
                      "[{\"image_id\": 1, \"category_id\": 1, \"score\": 0.5, \"segmentation\": "
                      "{\"size\": [2, 2], \"counts\": [1, 3]}}]}");
}

// Three depth images at 10 Hz from a camera that moves along x by 1 m in 0.2 s. The detections name
// each of them, and have one instance in the first.
class RgbdDatasetTest : public ::testing::Test {
 protected:
  RgbdDatasetTest() {
    folder_.Write("camera.yaml", kCamera);
    folder_.Write("depth.txt", "# stamp file\n10.0 d/0.png\n10.1 d/1.png\n10.2 d/2.png\n");
    folder_.Write("groundtruth.txt", "10.0 0 0 1 0 0 0 1\n10.2 1 0 1 0 0 0 1\n");
    for (const char* name : {"d/0.png", "d/1.png", "d/2.png"}) {
      folder_.Write(name, GreyPng(2, 2, {5000, 10000, 0, 12500}));
    }
    folder_.Write("detections.json", Coco(Image(1, "d/0.png") + "," + Image(2, "d/1.png") + "," +
                                          Image(3, "d/2.png")));
    options_.robot = "cart";
    options_.frame_id = "site";
  }

  std::unique_ptr<RgbdDataset> Open() {
    auto dataset = RgbdDataset::Open(folder_.path(), options_);
    EXPECT_TRUE(dataset.ok()) << dataset.status();
    return dataset.ok() ? *std::move(dataset) : nullptr;
  }
  std::string Error(const RgbdDataset& dataset, size_t i) {
    const auto frame = dataset.Load(i, skipped_);
    return frame.ok() ? "" : std::string(frame.status().message());
  }

  testing::TemporaryFolder folder_;
  RgbdOptions options_;
  SkipCounts skipped_;
};

TEST_F(RgbdDatasetTest, AFrameIsDepthPoseAndInstances) {
  options_.pose_sigma = {1, 2, 3};
  const auto dataset = Open();
  ASSERT_EQ(dataset->size(), 3u);
  EXPECT_THAT(dataset->skipped(), IsEmpty());
  const auto frame = dataset->Load(0, skipped_);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->robot, "cart");
  EXPECT_EQ(frame->sequence, 0);
  EXPECT_EQ(frame->stamp, absl::FromUnixSeconds(10));
  EXPECT_EQ(frame->frame_id, "site");
  EXPECT_EQ(frame->camera.fx, 2.0);
  EXPECT_THAT(frame->depth.metres, ElementsAre(1.0f, 2.0f, 0.0f, 2.5f));
  EXPECT_EQ(frame->pose_covariance(1, 1), 4.0);
  ASSERT_EQ(frame->instances.size(), 1u);
  EXPECT_THAT(frame->instances[0].mask, ElementsAre(0, 1, 1, 1));
  EXPECT_TRUE(Validate(*frame).ok());
}

TEST_F(RgbdDatasetTest, TheFileOfThePosesStatesTheirSigma) {
  const std::string poses = "10.0 0 0 1 0 0 0 1\n10.2 1 0 1 0 0 0 1\n";
  folder_.Write("stated.txt", "# pose_sigma: 0.1,0.2,0.3\n" + poses);
  folder_.Write("estimated.txt", poses);
  const auto covariance = [this](const std::string& file, std::optional<PoseSigma> option) {
    options_.poses = file;
    options_.pose_sigma = option;
    const auto dataset = Open();
    return dataset->Load(0, skipped_)->pose_covariance;
  };
  EXPECT_EQ(covariance("stated.txt", std::nullopt), (PoseSigma{0.1, 0.2, 0.3}.Covariance()));
  EXPECT_EQ(covariance("stated.txt", PoseSigma{1, 2, 3}), (PoseSigma{1, 2, 3}.Covariance()));
  EXPECT_EQ(covariance("groundtruth.txt", std::nullopt), kMotionCaptureSigma.Covariance());
  EXPECT_EQ(covariance("estimated.txt", std::nullopt), kLocalisationSigma.Covariance());
}

TEST_F(RgbdDatasetTest, PosesAreInterpolated) {
  const auto dataset = Open();
  const auto frame = dataset->Load(1, skipped_);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_TRUE(frame->frame_from_camera.translation().isApprox(Eigen::Vector3d(0.5, 0, 1)));
  EXPECT_THAT(frame->instances, IsEmpty()) << "nothing found is a frame all the same";
}

// A correction of the frames' poses by the same trajectory must not change a bit.
TEST_F(RgbdDatasetTest, PosesOnThePlaneAreThoseOfACorrection) {
  folder_.Write("groundtruth.txt",
                "9.93 0.1 0.2 1 -0.570471 0.572206 -0.415987 0.417251\n"
                "10.13 0.37 0.51 1 -0.506476 0.629898 -0.458836 0.369025\n"
                "10.19 0.73 0.11 1 -0.552253 0.588514 -0.430163 0.404510\n");
  const auto trajectory = Trajectory::Parse(*ReadFile(folder_.path() + "/groundtruth.txt"));
  const auto poses = trajectory->ViewPoses(kMotionCaptureSigma.Covariance());
  const auto dataset = Open();
  for (size_t i = 0; i < 3; ++i) {
    const auto frame = dataset->Load(i, skipped_);
    ASSERT_TRUE(frame.ok()) << frame.status();
    const auto corrected = PoseAt(poses, frame->stamp);
    ASSERT_TRUE(corrected) << i;
    EXPECT_EQ(frame->frame_from_view, corrected->frame_from_view);
    EXPECT_EQ(frame->pose_covariance, corrected->covariance);
    const PlanarTransform in_space = ViewPose(frame->frame_from_camera);
    EXPECT_NEAR(corrected->frame_from_view.x(), in_space.x(), 1e-9);
    EXPECT_NEAR(corrected->frame_from_view.yaw(), in_space.yaw(), 1e-3);
  }
}

TEST_F(RgbdDatasetTest, SequencesFollowTheStampsWhateverTheOrderOfLines) {
  folder_.Write("depth.txt", "10.2 d/2.png\nrubbish\n10.0 d/0.png\n10.1 d/1.png\n10.1 d/0.png\n");
  const auto dataset = Open();
  ASSERT_EQ(dataset->size(), 3u);
  EXPECT_EQ(dataset->stamp(0), absl::FromUnixSeconds(10));
  EXPECT_EQ(dataset->sequence(2), 2);
  EXPECT_THAT(dataset->skipped(),
              UnorderedElementsAre(Pair("bad line of depth.txt", 1),
                                   Pair("depth image with the stamp of another", 1)));
}

TEST_F(RgbdDatasetTest, ImagesOfOtherNamesBelongToTheNearestDepthImage) {
  folder_.Write("detections.json",
                Coco(Image(1, "rgb/10.115.png") + "," +                   // Matched to 10.1 first.
                     Image(2, "a.png", ", \"timestamp\": 10.09") + "," +  // Nearer to 10.1.
                     Image(3, "b.png", ", \"timestamp\": 10.03") + "," +  // Too far from any.
                     Image(4, "c.png")));
  const auto dataset = Open();
  EXPECT_THAT(dataset->skipped(),
              ElementsAre(Pair("image of the detections without a depth image", 3)));
  EXPECT_EQ(Error(*dataset, 0), "not looked at by the detector");
  EXPECT_EQ(Error(*dataset, 2), "not looked at by the detector");
  const auto frame = dataset->Load(1, skipped_);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_THAT(frame->instances, IsEmpty()) << "image 2 is nearer than image 1";
}

TEST_F(RgbdDatasetTest, ResultsWithoutImagesCountFromZero) {
  folder_.Write("detections.json",
                R"([{"image_id": 2, "scores": {"cup": 0.5},
                     "segmentation": {"size": [2, 2], "counts": [1, 3]}}])");
  const auto dataset = Open();
  EXPECT_EQ(dataset->Load(0, skipped_)->instances.size(), 0u);
  EXPECT_EQ(dataset->Load(2, skipped_)->instances.size(), 1u);
}

TEST_F(RgbdDatasetTest, ABadDepthImageHarmsItsFrameAlone) {
  folder_.Write("d/0.png", GreyPng(3, 2, {1, 2, 3, 4, 5, 6}));
  folder_.Write("d/1.png", "no PNG");
  const auto dataset = Open();
  EXPECT_THAT(Error(*dataset, 0), HasSubstr("bad depth image: d/0.png: depth image of 3x2"));
  EXPECT_THAT(Error(*dataset, 1), HasSubstr("bad depth image: d/1.png: broken PNG"));
  EXPECT_EQ(Error(*dataset, 2), "");

  const std::string good = GreyPng(2, 2, {1, 2, 3, 4});
  folder_.Write("d/0.png", good.substr(0, good.size() - 20));
  folder_.Write("d/1.png", GreyPng(2, 2, {1, 2, 3, 4}, 8));
  folder_.Write("d/2.png", GreyPng(2, 2, {0, 0, 0, 0}));
  EXPECT_THAT(Error(*dataset, 0), HasSubstr("broken PNG"));
  EXPECT_THAT(Error(*dataset, 1), HasSubstr("no grey PNG of 16 bits"));
  EXPECT_THAT(Error(*dataset, 2), HasSubstr("depth image without any depth: "));
}

TEST_F(RgbdDatasetTest, AMissingDepthImageHarmsItsFrameAlone) {
  folder_.Write("depth.txt", "10.0 d/0.png\n10.1 d/none.png\n10.2 d\n");
  folder_.Write("detections.json",
                Coco(Image(1, "d/0.png") + "," + Image(2, "d/none.png") + "," + Image(3, "d")));
  const auto dataset = Open();
  EXPECT_EQ(Error(*dataset, 0), "");
  EXPECT_THAT(Error(*dataset, 1), HasSubstr("missing depth image: "));
  EXPECT_THAT(Error(*dataset, 2), HasSubstr("missing depth image: "));
}

TEST_F(RgbdDatasetTest, AFrameWithoutAPoseIsNone) {
  folder_.Write("groundtruth.txt", "10.0 0 0 1 0 0 0 1\n10.1 nan 0 1 0 0 0 1\n");
  const auto dataset = Open();
  EXPECT_EQ(Error(*dataset, 0), "");
  EXPECT_EQ(Error(*dataset, 1), "bad pose");
  EXPECT_EQ(Error(*dataset, 2), "outside of the trajectory");
  EXPECT_THAT(dataset->skipped(), ElementsAre(Pair("bad line of the trajectory", 1)));
}

TEST_F(RgbdDatasetTest, FilesMayLieElsewhere) {
  testing::TemporaryFolder other;
  other.Write("poses.txt", "10.0 5 0 1 0 0 0 1\n");
  options_.poses = other.path() + "/poses.txt";
  const auto dataset = Open();
  const auto frame = dataset->Load(0, skipped_);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->frame_from_camera.translation().x(), 5.0);
}

TEST_F(RgbdDatasetTest, WithoutOneOfItsFilesThereIsNoDataset) {
  const auto error = [this](RgbdOptions options) {
    return std::string(RgbdDataset::Open(folder_.path(), options).status().ToString());
  };
  RgbdOptions options = options_;
  options.poses = "none.txt";
  EXPECT_THAT(error(options), ::testing::AllOf(HasSubstr("NOT_FOUND"), HasSubstr("none.txt")));
  options = options_;
  options.detections = "none.json";
  EXPECT_THAT(error(options), HasSubstr("none.json"));
  folder_.Write("depth.txt", "# empty\n");
  EXPECT_THAT(error(options_), HasSubstr("depth.txt: no line"));
  folder_.Write("camera.yaml", "image_width: 2\n");
  EXPECT_THAT(error(options_), HasSubstr("camera.yaml"));
  EXPECT_THAT(RgbdDataset::Open("/nonexistent", {}).status().ToString(), HasSubstr("NOT_FOUND"));
}

TEST(RgbdDatasetOnRealDataTest, EveryFrameOfTheOfficeLoads) {
  const char* data = std::getenv("HYPERMAP_DATA");
  const std::string folder =
      std::string(data != nullptr ? data : HYPERMAP_SOURCE_DIR "/../shared/data") +
      "/rgbd/office_small";
  RgbdOptions options;
  options.poses = "estimated.txt";
  options.detections = "detections_noisy.json";
  const auto dataset = RgbdDataset::Open(folder, options);
  if (absl::IsNotFound(dataset.status())) GTEST_SKIP() << dataset.status();
  ASSERT_TRUE(dataset.ok()) << dataset.status();
  EXPECT_EQ((*dataset)->size(), 670u);
  EXPECT_THAT((*dataset)->skipped(), IsEmpty());
  SkipCounts skipped;
  size_t instances = 0;
  for (size_t i = 0; i < (*dataset)->size(); ++i) {
    const auto frame = (*dataset)->Load(i, skipped);
    ASSERT_TRUE(frame.ok()) << frame.status();
    ASSERT_TRUE(Validate(*frame).ok());
    instances += frame->instances.size();
  }
  EXPECT_EQ(instances, 3230u);
  EXPECT_THAT(skipped, IsEmpty());
}

}  // namespace
}  // namespace hypermap::ingest
