#include "client_libs/ros2/conversion/shapes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/random_map.h"

namespace hypermap::ros2 {
namespace {

using ::testing::ElementsAre;
using visualization_msgs::Marker;

SemanticObject Object(const std::string& label, Shape shape) {
  SemanticObject object;
  object.label = label;
  object.shape = std::move(shape);
  return object;
}

LayerSpec Layer(const std::string& name, const std::string& frame_id) {
  LayerSpec spec;
  spec.name = name;
  spec.frame_id = frame_id;
  return spec;
}

TEST(ShapesTest, ObjectsOfAMapAreInItsOwnFrame) {
  SemanticObject desk = Object("desk", *Polygon::Make({{0, 0}, {1, 0}, {1, 1}}));
  desk.classes = {{"desk", 0.75}, {"table", 0.25}};
  const Snapshot map = testing::MakeSnapshot(
      "site", {{CreateLayer{Layer("things", "robot")}, PutObject{"things", desk, ""},
                SetTransform{{"map", "robot", PlanarTransform(10, 20, M_PI / 2)}}}});
  const auto message = ToSemanticMap(map, *map.FindSemantic("things"));
  ASSERT_EQ(message.objects.size(), 1U);
  const auto& object = message.objects[0];
  EXPECT_EQ(object.id, 1U);
  EXPECT_EQ(object.name, "desk");
  EXPECT_THAT(object.tags, ElementsAre("desk", "table"));
  EXPECT_THAT(object.confidence, ElementsAre(0.75, 0.25));
  ASSERT_EQ(object.shape.points.size(), 3U);
  EXPECT_NEAR(object.shape.points[1].x, 10.0, 1e-6);
  EXPECT_NEAR(object.shape.points[1].y, 21.0, 1e-6);
}

TEST(ShapesTest, MarkersDrawEveryShapeWithItsLabel) {
  const Polygon ring = *Polygon::Make({{0, 0}, {4, 0}, {4, 4}}, {{{2.5, 1}, {3, 1}, {3, 1.5}}});
  const Snapshot map = testing::MakeSnapshot(
      "site", {{CreateLayer{Layer("zones", "map")}, PutObject{"zones", Object("zone", ring), ""},
                PutObject{"zones", Object("lane", *LineString::Make({{0, 0}, {1, 1}})), ""},
                PutObject{"zones", Object("dock", *Shape::MakePoint({2, 3})), ""}}});
  const auto markers = ToMarkers(map, absl::UnixEpoch()).markers;
  ASSERT_EQ(markers.size(), 7U);
  EXPECT_EQ(markers[0].action, Marker::kDeleteAll);
  EXPECT_EQ(markers[1].type, Marker::kLineList);
  EXPECT_EQ(markers[1].points.size(), 12U);
  EXPECT_EQ(markers[2].text, "zone");
  EXPECT_EQ(markers[3].type, Marker::kLineStrip);
  EXPECT_EQ(markers[5].type, Marker::kSphere);
  EXPECT_EQ(markers[5].pose.position.y, 3.0);
  for (size_t i = 1; i < markers.size(); ++i) EXPECT_EQ(markers[i].id, static_cast<int32_t>(i - 1));
}

// The dashboard and its gateway read the same table in their tests.
TEST(ShapesTest, ClassesHaveTheColoursOfTheDashboard) {
  std::ifstream file(HYPERMAP_SOURCE_DIR "/client_libs/testing/class_colours.json");
  const auto colours = nlohmann::json::parse(file);
  EXPECT_FALSE(colours.empty());
  for (const auto& [label, expected] : colours.items()) {
    const std_msgs::ColorRGBA colour = ClassColour(label);
    const nlohmann::json found = {std::lround(255 * colour.r), std::lround(255 * colour.g),
                                  std::lround(255 * colour.b)};
    EXPECT_EQ(found, expected) << label;
  }
}

TEST(ShapesTest, TransformsAreEdgesOfTheFrameTree) {
  FrameTree frames;
  ASSERT_TRUE(frames.Set({"map", "dock", PlanarTransform(1, 2, M_PI / 2)}).ok());
  const auto message = ToTransforms(frames, absl::UnixEpoch());
  ASSERT_EQ(message.transforms.size(), 1U);
  EXPECT_EQ(message.transforms[0].header.frame_id, "map");
  EXPECT_EQ(message.transforms[0].child_frame_id, "dock");
  EXPECT_EQ(message.transforms[0].transform.translation.y, 2.0);
  EXPECT_NEAR(message.transforms[0].transform.rotation.z, std::sqrt(0.5), 1e-12);
}

}  // namespace
}  // namespace hypermap::ros2
