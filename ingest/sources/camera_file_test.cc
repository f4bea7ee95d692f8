#include "ingest/sources/camera_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace hypermap::ingest {
namespace {

using testing::HasSubstr;

std::string Yaml(const std::string& matrix, const std::string& model,
                 const std::string& coefficients) {
  return "image_width: 320\nimage_height: 240\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: " +
         matrix + "\ndistortion_model: " + model +
         "\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: " + coefficients + "\n";
}
constexpr char kMatrix[] = "[262.5, 0, 159.5, 0, 263.5, 119.5, 0, 0, 1]";

TEST(CameraFileTest, ACalibrationWithDistortion) {
  const auto camera = ParseCameraInfo(Yaml(kMatrix, "plumb_bob", "[0.1, -0.2, 0.01, 0.02, 0.3]"));
  ASSERT_TRUE(camera.ok()) << camera.status();
  EXPECT_EQ(camera->width, 320);
  EXPECT_EQ(camera->height, 240);
  EXPECT_EQ(camera->fx, 262.5);
  EXPECT_EQ(camera->fy, 263.5);
  EXPECT_EQ(camera->cx, 159.5);
  EXPECT_EQ(camera->cy, 119.5);
  EXPECT_THAT(camera->distortion, testing::ElementsAre(0.1, -0.2, 0.01, 0.02, 0.3));
}

TEST(CameraFileTest, WithoutCoefficientsThereIsNoDistortion) {
  const auto camera = ParseCameraInfo(Yaml(kMatrix, "plumb_bob", "[]"));
  ASSERT_TRUE(camera.ok()) << camera.status();
  EXPECT_FALSE(camera->distorted());
  const auto bare = ParseCameraInfo(
      "image_width: 2\nimage_height: 2\ncamera_matrix: {data: [2, 0, 1, 0, 2, 1, 0, 0, 1]}\n");
  ASSERT_TRUE(bare.ok()) << bare.status();
  EXPECT_FALSE(bare->distorted());
}

TEST(CameraFileTest, WhatIsNoPinholeCameraIsRefused) {
  EXPECT_TRUE(absl::IsUnimplemented(
      ParseCameraInfo(Yaml(kMatrix, "equidistant", "[0, 0, 0, 0]")).status()));
  EXPECT_THAT(ParseCameraInfo(Yaml("[1, 2]", "plumb_bob", "[]")).status().message(),
              HasSubstr("camera_matrix"));
  EXPECT_THAT(ParseCameraInfo(Yaml("[0,0,1,0,0,1,0,0,1]", "plumb_bob", "[]")).status().message(),
              HasSubstr("camera_matrix"));
  EXPECT_THAT(ParseCameraInfo(Yaml(kMatrix, "plumb_bob", "[.nan]")).status().message(),
              HasSubstr("distortion_coefficients"));
  EXPECT_FALSE(ParseCameraInfo("").ok());
  EXPECT_FALSE(ParseCameraInfo("[1, 2").ok());
  EXPECT_FALSE(ParseCameraInfo("image_width: 99999999\nimage_height: 1\n").ok());
}

}  // namespace
}  // namespace hypermap::ingest
