#include "client_libs/ros2/conversion/images.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "base/images/png.h"

namespace hypermap::ros2 {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

sensor_msgs::CameraInfo Info() {
  sensor_msgs::CameraInfo info;
  info.width = 3;
  info.height = 2;
  info.distortion_model = "plumb_bob";
  info.d = {0.1, -0.2, 0.001, 0.002, 0.05};
  info.k = {500, 0, 1.5, 0, 510, 0.5, 0, 0, 1};
  info.p = {480, 0, 1.25, 7, 0, 490, 0.75, 8, 0, 0, 1, 0};
  return info;
}

v1::CameraModel Camera() { return *ToCameraModel(Info(), /*is_rectified=*/false); }

// An image of the camera, whose rows end with `padding` bytes of noise.
template <typename Sample>
sensor_msgs::Image ImageOf(const std::string& encoding, std::vector<Sample> samples,
                           int padding = 0, bool is_big = false) {
  sensor_msgs::Image image;
  image.width = 3;
  image.height = 2;
  image.encoding = encoding;
  image.is_bigendian = is_big ? 1 : 0;
  image.step = 3 * sizeof(Sample) + padding;
  for (size_t i = 0; i < samples.size(); ++i) {
    uint8_t bytes[sizeof(Sample)];
    std::memcpy(bytes, &samples[i], sizeof(Sample));
    if (is_big) std::reverse(bytes, bytes + sizeof(Sample));
    image.data.insert(image.data.end(), bytes, bytes + sizeof(Sample));
    if (i % 3 == 2) image.data.insert(image.data.end(), padding, 99);
  }
  return image;
}

TEST(ImagesTest, ACameraHasItsCalibration) {
  const auto raw = ToCameraModel(Info(), /*is_rectified=*/false);
  ASSERT_TRUE(raw.ok()) << raw.status();
  EXPECT_EQ(raw->ShortDebugString(),
            "width: 3 height: 2 fx: 500 fy: 510 cx: 1.5 cy: 0.5 distortion: 0.1 distortion: -0.2 "
            "distortion: 0.001 distortion: 0.002 distortion: 0.05");
  const auto rectified = ToCameraModel(Info(), /*is_rectified=*/true);
  ASSERT_TRUE(rectified.ok()) << rectified.status();
  EXPECT_EQ(rectified->ShortDebugString(), "width: 3 height: 2 fx: 480 fy: 490 cx: 1.25 cy: 0.75");
}

TEST(ImagesTest, CamerasThatAreNoPinholeCamerasAreRefused) {
  sensor_msgs::CameraInfo info = Info();
  info.distortion_model = "equidistant";
  EXPECT_FALSE(ToCameraModel(info, false).ok());
  EXPECT_TRUE(ToCameraModel(info, true).ok());
  info.d.assign(5, 0.0);
  EXPECT_TRUE(ToCameraModel(info, false).ok());
  info = Info();
  info.distortion_model = "rational_polynomial";
  info.d.resize(8, 0.0);
  EXPECT_EQ(ToCameraModel(info, false)->distortion_size(), 5);
  info.d[6] = 0.1;
  EXPECT_FALSE(ToCameraModel(info, false).ok());
  info = Info();
  info.k = {};
  EXPECT_FALSE(ToCameraModel(info, false).ok());
  info.k[0] = info.k[4] = kNan;
  EXPECT_FALSE(ToCameraModel(info, false).ok());
  info = Info();
  info.width = 4097;
  EXPECT_FALSE(ToCameraModel(info, false).ok());
}

TEST(ImagesTest, DepthInMillimetresIsPassedOn) {
  const std::vector<uint16_t> depth = {0, 1, 255, 256, 4660, 65535};
  const std::string expected(reinterpret_cast<const char*>(depth.data()), 12);
  for (const int padding : {0, 5}) {
    for (const bool is_big : {false, true}) {
      for (const char* encoding : {"16UC1", "mono16"}) {
        v1::RobotFrame frame;
        ASSERT_TRUE(EncodeDepth(ImageOf(encoding, depth, padding, is_big), Camera(), &frame).ok());
        EXPECT_EQ(frame.millimetres(), expected);
      }
    }
  }
}

TEST(ImagesTest, DepthInMetresIsRoundedToFifthsOfAMillimetre) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  v1::RobotFrame frame;
  ASSERT_TRUE(
      EncodeDepth(ImageOf<float>("32FC1", {nan, infinity, -1, 0, 1.23456F, 99}), Camera(), &frame)
          .ok());
  EXPECT_EQ(frame.png().units_per_metre(), 5000);
  auto reader = PngReader::Open(frame.png().png());
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_TRUE(reader->header().is_grey);
  std::vector<uint8_t> rows(12);
  ASSERT_TRUE(reader->ReadRows(rows.data()).ok());
  EXPECT_EQ(rows, (std::vector<uint8_t>{0, 0, 0, 0, 0, 0, 0, 0, 6173 >> 8, 6173 & 255, 255, 255}));
}

TEST(ImagesTest, ImagesThatAreNoDepthOfTheCameraAreRefused) {
  const std::vector<uint16_t> good(6, 1000);
  sensor_msgs::Image turned = ImageOf("16UC1", good);
  std::swap(turned.width, turned.height);
  sensor_msgs::Image cut = ImageOf("16UC1", good);
  cut.data.pop_back();
  sensor_msgs::Image huge = ImageOf("16UC1", good);
  huge.step = 0xffffffff;
  sensor_msgs::Image narrow = ImageOf("16UC1", good);
  narrow.step = 5;
  for (const sensor_msgs::Image& image :
       {turned, cut, huge, narrow, ImageOf("mono8", good), ImageOf("32FC1", good),
        ImageOf("16UC1", std::vector<uint16_t>(6, 0)), ImageOf("32FC1", std::vector<float>(6, -1)),
        sensor_msgs::Image()}) {
    v1::RobotFrame frame;
    EXPECT_EQ(EncodeDepth(image, Camera(), &frame).code(), absl::StatusCode::kInvalidArgument);
  }
}

TEST(ImagesTest, LabelImagesHaveNumbers) {
  const std::vector<int32_t> expected = {0, 1, 2, 200, 255, 3};
  const std::vector<uint8_t> small(expected.begin(), expected.end());
  EXPECT_EQ(*LabelNumbers(ImageOf("mono8", small, 1), Camera()), expected);
  EXPECT_EQ(*LabelNumbers(ImageOf("8UC1", small), Camera()), expected);
  const std::vector<uint16_t> middle(expected.begin(), expected.end());
  EXPECT_EQ(*LabelNumbers(ImageOf("16UC1", middle, 0, true), Camera()), expected);
  EXPECT_EQ(*LabelNumbers(ImageOf("mono16", middle), Camera()), expected);
  const std::vector<int32_t> large = {-1, 70000, 0, 0, 0, 1};
  EXPECT_EQ(*LabelNumbers(ImageOf("32SC1", large), Camera()), large);
  EXPECT_FALSE(LabelNumbers(ImageOf("rgb8", small), Camera()).ok());
}

}  // namespace
}  // namespace hypermap::ros2
