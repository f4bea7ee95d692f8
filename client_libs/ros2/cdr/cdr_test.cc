#include "client_libs/ros2/cdr/cdr.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "absl/strings/escaping.h"
#include "client_libs/ros2/messages/messages.h"

namespace hypermap::ros2 {
namespace {

std::string Hex(const std::string& bytes) { return absl::BytesToHexString(bytes); }

// tests/ros2 compares all messages with those of rosbags.
TEST(CdrTest, NumbersAreAlignedToTheirSizeAfterTheHeader) {
  std_msgs::Header header{{1, 2}, "map"};
  EXPECT_EQ(Hex(EncodeCdr(header)),
            "00010000"
            "01000000"
            "02000000"
            "04000000"
            "6d617000");
  geometry_msgs::PointStamped stamped{{{1, 2}, "ab"}, {1.0, 0.0, 0.0}};
  // The string ends at 15; the first double begins at 16.
  EXPECT_EQ(Hex(EncodeCdr(stamped)).substr(24, 24),
            "03000000"
            "61620000"
            "00000000");
}

TEST(CdrTest, MessagesComeBackEqual) {
  visualization_msgs::MarkerArray array;
  visualization_msgs::Marker marker;
  marker.ns = "zones";
  marker.points = {{1, 2, 3}, {4, 5, 6}};
  marker.frame_locked = true;
  marker.text = "Küche";
  array.markers = {marker, {}};
  const auto decoded = DecodeCdr<visualization_msgs::MarkerArray>(EncodeCdr(array));
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(Hex(EncodeCdr(*decoded)), Hex(EncodeCdr(array)));
  EXPECT_EQ(decoded->markers[0].text, "Küche");
  EXPECT_TRUE(decoded->markers[0].frame_locked);
}

TEST(CdrTest, BigEndianIsRead) {
  const auto time =
      DecodeCdr<builtin_interfaces::Time>(std::string("\0\0\0\0\0\0\0\1\0\0\0\2", 12));
  ASSERT_TRUE(time.ok()) << time.status();
  EXPECT_EQ(time->sec, 1);
  EXPECT_EQ(time->nanosec, 2U);
}

TEST(CdrTest, Version2AlignsToFourBytes) {
  // A frame "abcd" ends at 17; in version 2 the double begins at 20, in version 1 at 24.
  std::string bytes = EncodeCdr(geometry_msgs::PointStamped{{{1, 2}, "abcd"}, {7.0, 0.0, 0.0}});
  bytes.erase(24, 4);
  bytes[1] = 7;
  const auto read = DecodeCdr<geometry_msgs::PointStamped>(bytes);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->point.x, 7.0);
}

TEST(CdrTest, WhatIsCutShortIsAnError) {
  const std::string bytes = EncodeCdr(geometry_msgs::PointStamped{{{1, 2}, "map"}, {1, 2, 3}});
  for (size_t size = 0; size < bytes.size(); ++size) {
    SCOPED_TRACE(size);
    EXPECT_EQ(DecodeCdr<geometry_msgs::PointStamped>(bytes.substr(0, size)).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
  EXPECT_TRUE(DecodeCdr<geometry_msgs::PointStamped>(bytes + std::string(3, '\0')).ok());
  EXPECT_FALSE(DecodeCdr<geometry_msgs::PointStamped>(bytes + std::string(4, '\0')).ok());
}

TEST(CdrTest, FalseLengthsAllocateNothing) {
  CdrWriter writer;
  writer.Put(std::numeric_limits<uint32_t>::max());
  const std::string bytes = std::move(writer).Finish();
  EXPECT_FALSE(DecodeCdr<geometry_msgs::Polygon>(bytes).ok());
  EXPECT_FALSE(DecodeCdr<hypermap_msgs::GetSemanticByString::Request>(bytes).ok());
}

TEST(CdrTest, FalseLengthsOfLargeElementsAllocateLittle) {
  CdrWriter writer;
  writer.Put(std_msgs::Header());
  writer.Put(uint32_t{1'000'000});
  writer.PutRaw(std::string(1'000'000, '\xff'));
  const std::string bytes = std::move(writer).Finish();
  CdrReader reader(bytes);
  vision_msgs::Detection2DArray message;
  reader.Get(message);
  EXPECT_FALSE(reader.status().ok());
  EXPECT_LE(message.detections.size(), 1U);
}

TEST(CdrTest, BytesAreCopiedAtOnce) {
  sensor_msgs::Image image;
  image.encoding = "mono8";
  image.data = {0, 1, 254, 255};
  const auto decoded = DecodeCdr<sensor_msgs::Image>(EncodeCdr(image));
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->data, image.data);
}

TEST(CdrTest, OtherEncodingsAreRefused) {
  EXPECT_FALSE(
      DecodeCdr<builtin_interfaces::Time>(std::string("\0\3\0\0\0\0\0\1\0\0\0\2", 12)).ok());
}

}  // namespace
}  // namespace hypermap::ros2
