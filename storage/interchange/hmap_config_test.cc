#include "storage/interchange/hmap_config.h"

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

struct ConfigReading {
  absl::StatusOr<HmapConfig> config;
  std::vector<std::string> repairs;
};

ConfigReading ParseConfig(const std::string& text) {
  RepairLog log;
  ConfigReading reading{ParseHmapConfig(text, log), {}};
  reading.repairs = std::move(log).Take();
  return reading;
}

TEST(HmapConfigTest, ReadsLayersAndTransforms) {
  const ConfigReading reading = ParseConfig(
      "layer_cnt: 2\n"
      "layers:\n"
      "  - {name: grid, frame_id: map, load_file: true, file: floor, class: OccupancyGridLayer,"
      " subscribe_mode: false}\n"
      "  - {name: objects, frame_id: robot/odom, load_file: false, file: x, class: SemanticLayer}\n"
      "transforms:\n"
      "  - {frame_id: map, child_frame_id: robot/odom, transform_pose: [1, -2.5, 0.5]}\n");
  ASSERT_TRUE(reading.config.ok()) << reading.config.status();
  ASSERT_THAT(reading.config->layers, SizeIs(2));
  EXPECT_EQ(reading.config->layers[0].kind, LayerKind::kOccupancy);
  EXPECT_EQ(reading.config->layers[0].file, "floor");
  EXPECT_EQ(reading.config->layers[1].kind, LayerKind::kSemantic);
  EXPECT_EQ(reading.config->layers[1].frame_id, "robot/odom");
  EXPECT_EQ(reading.config->layers[1].file, "");
  EXPECT_THAT(reading.config->transforms,
              ElementsAre(FrameTransform{"map", "robot/odom", PlanarTransform(1, -2.5, 0.5)}));
  EXPECT_THAT(reading.repairs, IsEmpty());
}

TEST(HmapConfigTest, NamesThatTheDomainRefusesAreMadeFitAndReported) {
  const ConfigReading reading = ParseConfig(
      "layers:\n"
      "  - {name: my grid, frame_id: /map, class: SemanticLayer}\n"
      "  - {name: other, class: SemanticLayer}\n"
      "transforms:\n"
      "  - {frame_id: /map, child_frame_id: base link, transform_pose: [0, 0, 0]}\n");
  ASSERT_TRUE(reading.config.ok()) << reading.config.status();
  EXPECT_EQ(reading.config->layers[0].name, "my_grid");
  EXPECT_EQ(reading.config->layers[0].frame_id, "map");
  EXPECT_EQ(reading.config->layers[1].frame_id, "");
  EXPECT_EQ(reading.config->transforms[0].child_frame_id, "base_link");
  EXPECT_THAT(reading.repairs, ElementsAre("layer \"my grid\" renamed to \"my_grid\"",
                                           "frame \"/map\" renamed to \"map\"",
                                           "layer \"other\": no frame_id, taken as the map's own",
                                           "frame \"/map\" renamed to \"map\"",
                                           "frame \"base link\" renamed to \"base_link\""));
}

// A map in flow style.
std::string WithKeys(int count) {
  std::string text = "{";
  for (int i = 0; i < count; ++i) absl::StrAppend(&text, "key", i, ": 0, ");
  return text + "}";
}

TEST(HmapConfigTest, NamesWhatIsWrong) {
  const std::string layer = "{name: a, frame_id: map, class: SemanticLayer}";
  const auto with_transform = [&](const std::string& transform) {
    return "layers: [" + layer + "]\ntransforms: [" + transform + "]";
  };
  const std::pair<std::string, const char*> kCases[] = {
      {"", "not a map"},
      {"- a", "not a map"},
      {"{}", "layers is missing"},
      {"layers: 5", "layers is not a list"},
      {"layers: [5]", "layers[0]: it is not a map"},
      {"layers: [" + WithKeys(257) + "]", "layers[0]: it has more than 256 keys"},
      {WithKeys(257), "the YAML has more than 256 keys"},
      {"layers: [&a " + layer + "]\ntransforms: [*a]", "aliases"},
      {"layers: [{frame_id: map, class: SemanticLayer}]", "layers[0]: name is missing"},
      {"layers: [" + layer + ", " + layer + "]", "layers[1]: a second layer \"a\""},
      {"layers: [{name: a, frame_id: map}]", "class is missing"},
      {"layers: [{name: a, frame_id: map, class: CameraLayer}]", "class \"CameraLayer\""},
      {"layers: [{name: a, frame_id: '/', class: SemanticLayer}]", "frame_id is empty"},
      {"layers: [{name: a, frame_id: [m], class: SemanticLayer}]", "frame_id is not a string"},
      {"layers: [{name: a, frame_id: m, class: SemanticLayer, load_file: true}]",
       "file is missing"},
      {"layers: [{name: a, frame_id: m, class: SemanticLayer, load_file: maybe}]", "load_file"},
      {with_transform("5"), "transforms[0]: it is not a map"},
      {with_transform(WithKeys(257)), "transforms[0]: it has more than 256 keys"},
      {with_transform("{child_frame_id: a, transform_pose: [0, 0, 0]}"), "frame_id is missing"},
      {with_transform("{frame_id: a, transform_pose: [0, 0, 0]}"), "child_frame_id is missing"},
      {with_transform("{frame_id: a, child_frame_id: b}"), "transform_pose is missing"},
      {with_transform("{frame_id: a, child_frame_id: b, transform_pose: [0, 0]}"),
       "transform_pose is not a list"},
      {with_transform("{frame_id: a, child_frame_id: b, transform_pose: [0, .nan, 0]}"),
       "transform_pose [1]"},
      {with_transform("{frame_id: a, child_frame_id: a, transform_pose: [0, 0, 0]}"),
       "transforms[0]"},
      {with_transform("{frame_id: a, child_frame_id: b, transform_pose: [0, 0, 0]},"
                      "{frame_id: b, child_frame_id: a, transform_pose: [0, 0, 0]}"),
       "transforms[1]"},
  };
  for (const auto& [text, message] : kCases) {
    const absl::Status status = ParseConfig(text).config.status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr(message)) << text;
  }
}

TEST(HmapConfigTest, LongNamesAreCutInTheReport) {
  const std::string name(100'000, 'x');
  const ConfigReading reading = ParseConfig("layers:\n  - {name: " + name + ", frame_id: " + name +
                                            ", class: SemanticLayer}\n");
  ASSERT_TRUE(reading.config.ok()) << reading.config.status();
  ASSERT_THAT(reading.repairs, SizeIs(2));
  EXPECT_THAT(reading.repairs[0], HasSubstr("xxx...\" renamed to \"xxx"));
  EXPECT_THAT(reading.repairs[1], HasSubstr("xxx...\" renamed to \"xxx"));
}

TEST(HmapConfigTest, ALongChainOfFramesIsRefused) {
  std::string text = "layers: []\ntransforms:\n";
  for (int i = 0; i < 2001; ++i) {
    absl::StrAppend(&text, "  - {frame_id: f", i, ", child_frame_id: f", i + 1,
                    ", transform_pose: [0, 0, 0]}\n");
  }
  EXPECT_EQ(ParseConfig(text).config.status().code(), absl::StatusCode::kResourceExhausted);
}

TEST(HmapConfigTest, WritesExactlyTheOriginalsKeys) {
  HmapConfig config;
  config.layers.push_back({"grid", LayerKind::kOccupancy, "map", "grid"});
  config.layers.push_back({"objects", LayerKind::kSemantic, "odom", ""});
  EXPECT_EQ(FormatHmapConfig(config),
            "layers:\n"
            "  - name: grid\n"
            "    frame_id: map\n"
            "    load_file: true\n"
            "    file: grid\n"
            "    class: OccupancyGridLayer\n"
            "  - name: objects\n"
            "    frame_id: odom\n"
            "    load_file: false\n"
            "    class: SemanticLayer\n");
  config.layers.clear();
  config.transforms.push_back({"map", "odom", PlanarTransform(1, 2, 0.25)});
  EXPECT_EQ(FormatHmapConfig(config),
            "layers: []\n"
            "transforms:\n"
            "  - frame_id: map\n"
            "    child_frame_id: odom\n"
            "    transform_pose: [1, 2, 0.25]\n");
  EXPECT_EQ(ParseConfig(FormatHmapConfig(config)).config->transforms, config.transforms);
}

}  // namespace
}  // namespace hypermap::storage
