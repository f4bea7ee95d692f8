#include "client_libs/cli/robot_paths.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hypermap::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string Collection(const std::string& features) {
  return R"({"type": "FeatureCollection", "features": [)" + features + "]}";
}

constexpr char kLine[] =
    R"({"type": "Feature", "properties": {"robot": "r1"},
        "geometry": {"type": "LineString", "coordinates": [[0, 1], [2.5, -1, 7]]}})";

TEST(ReadRobotPathsTest, EachLineIsAPath) {
  const auto paths = ReadRobotPaths(Collection(std::string(kLine) + "," + kLine));
  ASSERT_TRUE(paths.ok()) << paths.status();
  const RobotPath path{"r1", {{0, 1}, {2.5, -1}}};
  EXPECT_THAT(*paths, ElementsAre(path, path));
  EXPECT_TRUE(ReadRobotPaths(Collection(""))->empty());
  EXPECT_TRUE(ReadRobotPaths(Collection(R"({"properties": {"robot": "r1"},
      "geometry": {"type": "LineString", "coordinates": []}})"))
                  ->empty());
}

TEST(ReadRobotPathsTest, OtherThingsAreErrors) {
  for (const char* text :
       {"", "[", "[]", "3", R"({"type": "FeatureCollection"})", R"({"features": []})"}) {
    EXPECT_THAT(std::string(ReadRobotPaths(text).status().message()),
                HasSubstr("not a GeoJSON FeatureCollection"))
        << text;
  }
  for (const char* feature :
       {"3", "{}", R"({"properties": {"robot": "r1"}, "geometry": null})",
        R"({"properties": {}, "geometry": {"type": "LineString", "coordinates": [[0, 1]]}})",
        R"({"properties": {"robot": 3},
            "geometry": {"type": "LineString", "coordinates": [[0, 1]]}})",
        R"({"properties": {"robot": "r1"}, "geometry": {"type": "Point", "coordinates": [0, 1]}})",
        R"({"properties": {"robot": "r1"},
            "geometry": {"type": "LineString", "coordinates": [[0]]}})",
        R"({"properties": {"robot": "r1"},
            "geometry": {"type": "LineString", "coordinates": [["a", 1]]}})"}) {
    const absl::Status status =
        ReadRobotPaths(Collection(std::string(kLine) + "," + feature)).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << feature;
    EXPECT_THAT(std::string(status.message()), HasSubstr("features[1] ")) << feature;
  }
}

}  // namespace
}  // namespace hypermap::cli
