#include "client_libs/ros2/conversion/instances.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

namespace hypermap::ros2 {
namespace {

constexpr int kWidth = 5;
constexpr int kHeight = 4;

v1::CameraModel SmallCamera() {
  v1::CameraModel camera;
  camera.set_width(kWidth);
  camera.set_height(kHeight);
  return camera;
}

vision_msgs::Detection2D Detection(double x, double y, double width, double height,
                                   double theta = 0.0) {
  vision_msgs::Detection2D detection;
  detection.bbox = {{{x, y}, theta}, width, height};
  detection.results = {{{"41", 0.5}, {}}};
  return detection;
}

// The mask as a row of text for each row of the image.
std::string Drawn(const v1::FrameInstance& instance) {
  std::string columns;
  char pixel = '.';
  for (const int32_t count : instance.runs().counts()) {
    columns.append(count, pixel);
    pixel = pixel == '.' ? '#' : '.';
  }
  EXPECT_EQ(columns.size(), size_t{kWidth * kHeight});
  std::string rows;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) rows.push_back(columns[u * kHeight + v]);
    rows.push_back('\n');
  }
  return rows;
}

FrameInstances InstancesOf(const vision_msgs::Detection2D& detection, int64_t* num_skipped,
                           const Labels& labels = {}) {
  vision_msgs::Detection2DArray message;
  message.detections = {detection};
  return BoxInstances(message, labels, SmallCamera(), num_skipped);
}

TEST(BoxInstancesTest, BoxesCoverThePixelsWhoseCentresAreInside) {
  int64_t num_skipped = 0;
  const FrameInstances upright = InstancesOf(Detection(2, 1, 2, 2), &num_skipped);
  ASSERT_EQ(upright.size(), 1);
  EXPECT_EQ(Drawn(upright[0]), ".##..\n.##..\n.....\n.....\n");
  const double quarter = std::numbers::pi / 2;
  const FrameInstances turned = InstancesOf(Detection(2, 1, 2, 4, quarter), &num_skipped);
  ASSERT_EQ(turned.size(), 1);
  EXPECT_EQ(Drawn(turned[0]), "####.\n####.\n.....\n.....\n");
  const FrameInstances whole = InstancesOf(Detection(0, 0, 1e300, 1e300), &num_skipped);
  ASSERT_EQ(whole.size(), 1);
  EXPECT_EQ(Drawn(whole[0]), "#####\n#####\n#####\n#####\n");
  EXPECT_EQ(num_skipped, 0);
}

TEST(BoxInstancesTest, ATurnedBoxIsThatOfAllPixelsChecked) {
  for (int step = 0; step < 100; ++step) {
    const double theta = 0.1 * step;
    int64_t num_skipped = 0;
    const FrameInstances found = InstancesOf(Detection(2.2, 1.9, 3.1, 1.7, theta), &num_skipped);
    std::string expected;
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const double along = std::cos(theta) * (u + 0.5 - 2.2) + std::sin(theta) * (v + 0.5 - 1.9);
        const double across = std::cos(theta) * (v + 0.5 - 1.9) - std::sin(theta) * (u + 0.5 - 2.2);
        const bool is_inside = std::abs(along) <= 1.55 && std::abs(across) <= 0.85;
        expected.push_back(is_inside ? '#' : '.');
      }
      expected.push_back('\n');
    }
    ASSERT_EQ(found.size(), 1);
    EXPECT_EQ(Drawn(found[0]), expected);
  }
}

TEST(BoxInstancesTest, TheHighestScoreOfALabelCounts) {
  vision_msgs::Detection2D detection = Detection(2, 2, 9, 9);
  detection.results = {{{"41", 0.5}, {}}, {{"7", 0.25}, {}}, {{"42", 0.75}, {}},
                       {{"8", 0.0}, {}},  {{"9", 1.5}, {}},  {{"", 0.5}, {}}};
  int64_t num_skipped = 0;
  const FrameInstances found = InstancesOf(detection, &num_skipped, {{"41", "cup"}, {"42", "cup"}});
  ASSERT_EQ(found.size(), 1);
  ASSERT_EQ(found[0].scores_size(), 2);
  EXPECT_EQ(found[0].scores(0).ShortDebugString(), "label: \"7\" score: 0.25");
  EXPECT_EQ(found[0].scores(1).ShortDebugString(), "label: \"cup\" score: 0.75");
}

TEST(BoxInstancesTest, WhatCannotBeUsedIsCounted) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  vision_msgs::Detection2D unscored = Detection(2, 2, 9, 9);
  unscored.results[0].hypothesis.score = nan;
  vision_msgs::Detection2D foreign = Detection(2, 2, 9, 9);
  foreign.results[0].hypothesis.class_id = "\xff";
  vision_msgs::Detection2DArray message;
  message.detections = {unscored,
                        foreign,
                        Detection(9, 9, 2, 2),
                        Detection(nan, 1, 2, 2),
                        Detection(1, 1, -2, 2),
                        Detection(2, 2, 1, 1, nan)};
  int64_t num_skipped = 0;
  EXPECT_TRUE(BoxInstances(message, {}, SmallCamera(), &num_skipped).empty());
  EXPECT_EQ(num_skipped, 6);
}

TEST(BoxInstancesTest, The254BestAreTakenInTheirOrder) {
  vision_msgs::Detection2DArray message;
  message.detections.assign(1000, Detection(2, 2, 9, 9));
  for (int i = 0; i < 1000; ++i) {
    message.detections[i].results[0].hypothesis.score = i % 4 == 1 ? 0.9 : 0.1;
  }
  int64_t num_skipped = 0;
  const FrameInstances found = BoxInstances(message, {}, SmallCamera(), &num_skipped);
  EXPECT_EQ(num_skipped, 746);
  ASSERT_EQ(found.size(), 254);
  std::vector<double> scores;
  for (const v1::FrameInstance& instance : found) scores.push_back(instance.scores(0).score());
  // The first four of low scores stand among all 250 of high ones.
  EXPECT_EQ(std::count(scores.begin(), scores.end(), 0.9), 250);
  EXPECT_EQ(std::vector<double>(scores.begin(), scores.begin() + 6),
            (std::vector<double>{0.1, 0.9, 0.1, 0.1, 0.1, 0.9}));
}

sensor_msgs::Image LabelImage(const std::vector<uint8_t>& numbers) {
  sensor_msgs::Image image;
  image.width = kWidth;
  image.height = kHeight;
  image.step = kWidth;
  image.encoding = "mono8";
  image.data = numbers;
  return image;
}

TEST(LabelImageInstancesTest, RegionsOfAClassAreInstances) {
  const auto found =
      LabelImageInstances(LabelImage({1, 1, 0, 0, 9,  //
                                      0, 0, 0, 2, 9,  //
                                      0, 1, 1, 2, 9,  //
                                      0, 1, 0, 0, 2}),
                          {.labels = {{"1", "cup"}, {"2", "cat"}}, .score = 0.5}, SmallCamera());
  ASSERT_TRUE(found.ok()) << found.status();
  ASSERT_EQ(found->size(), 3);
  EXPECT_EQ((*found)[0].scores(0).ShortDebugString(), "label: \"cup\" score: 0.5");
  EXPECT_EQ(Drawn((*found)[0]), ".....\n.....\n.##..\n.#...\n");
  EXPECT_EQ(Drawn((*found)[1]), "##...\n.....\n.....\n.....\n");
  EXPECT_EQ((*found)[2].scores(0).label(), "cat");
  EXPECT_EQ(Drawn((*found)[2]), ".....\n...#.\n...#.\n....#\n");
}

TEST(LabelImageInstancesTest, ADivisorTellsInstancesApart) {
  const auto found = LabelImageInstances(LabelImage({11, 0, 0, 0, 11,  //
                                                     12, 0, 0, 0, 0,   //
                                                     12, 0, 0, 0, 30,  //
                                                     0,  0, 0, 0, 0}),
                                         {.labels = {{"1", "cup"}}, .divisor = 10}, SmallCamera());
  ASSERT_TRUE(found.ok()) << found.status();
  ASSERT_EQ(found->size(), 2);
  EXPECT_EQ(Drawn((*found)[0]), "#...#\n.....\n.....\n.....\n");
  EXPECT_EQ(Drawn((*found)[1]), ".....\n#....\n#....\n.....\n");
}

TEST(LabelImageInstancesTest, NegativeNumbersAreOfNegativeClasses) {
  sensor_msgs::Image image = LabelImage(std::vector<uint8_t>(4 * kWidth * kHeight, 0xff));
  image.encoding = "32SC1";  // all pixels are -1
  image.step = 4 * kWidth;
  EXPECT_TRUE(LabelImageInstances(image, {.labels = {{"0", "cup"}}, .divisor = 10}, SmallCamera())
                  ->empty());
  EXPECT_EQ(
      LabelImageInstances(image, {.labels = {{"-1", "cup"}}, .divisor = 10}, SmallCamera())->size(),
      1);
}

TEST(LabelImageInstancesTest, TheMostInstancesOfAClassAre254) {
  v1::CameraModel camera;
  camera.set_width(64);
  camera.set_height(64);
  sensor_msgs::Image image;
  image.width = image.height = image.step = 64;
  image.encoding = "8UC1";
  image.data.assign(64 * 64, 0);
  for (int v = 0; v < 64; v += 2) {
    for (int u = 0; u < 64; u += 2) image.data[v * 64 + u] = 1;
  }
  EXPECT_EQ(LabelImageInstances(image, {.labels = {{"1", "cup"}}}, camera)->size(), 254);
}

TEST(LabelImageInstancesTest, TheMostNumbersOfAClassAre254) {
  v1::CameraModel camera;
  camera.set_width(32);
  camera.set_height(32);
  sensor_msgs::Image image;
  image.width = image.height = 32;
  image.step = 64;
  image.encoding = "16UC1";
  for (int i = 0; i < 32 * 32; ++i) {  // instances 0 to 1023 of class 1
    const int number = 10'000 + i;
    image.data.push_back(static_cast<uint8_t>(number % 256));
    image.data.push_back(static_cast<uint8_t>(number / 256));
  }
  const auto found =
      LabelImageInstances(image, {.labels = {{"1", "cup"}}, .divisor = 10'000}, camera);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ(found->size(), 254);
}

TEST(LabelImageInstancesTest, OtherImagesAreRefused) {
  sensor_msgs::Image image = LabelImage({1, 2, 3});
  EXPECT_EQ(LabelImageInstances(image, {}, SmallCamera()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace hypermap::ros2
