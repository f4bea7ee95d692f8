#include "storage/interchange/hmap.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/interchange/png_codec.h"
#include "storage/interchange/testing/archive.h"
#include "storage/interchange/testing/content.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using testing::Grid;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kOccupancyYaml;
using testing::MapOf;
using testing::Objects;
using testing::OccupancyHmap;
using testing::SemanticHmap;
using ::testing::SizeIs;
using testing::Zip;

ImportedMap Decode(const std::string& data) {
  absl::StatusOr<ImportedMap> imported = DecodeHmap(data, Limits());
  EXPECT_TRUE(imported.ok()) << imported.status();
  return imported.ok() ? *std::move(imported) : ImportedMap();
}

std::string Png(const GreyAlphaImage& image) { return *EncodePng(image, PngChannels::kGreyAlpha); }

SemanticObject Object(const std::string& label) {
  SemanticObject object;
  object.label = label;
  object.classes = {{label, 1.0}};
  object.shape = *Polygon::Make({{0, 0}, {2, 0}, {2, 2}});
  return object;
}

Snapshot Made(const std::vector<Edit>& edits, const std::string& frame_id = "map") {
  Snapshot empty;
  empty.map_name = "site";
  empty.frame_id = frame_id;
  const absl::StatusOr<AppliedBatch> applied = Apply(empty, EditBatch{edits});
  EXPECT_TRUE(applied.ok()) << applied.status();
  return applied.ok() ? *applied->snapshot : empty;
}

LayerSpec GridSpec(const std::string& name, LayerKind kind = LayerKind::kOccupancy) {
  return {.name = name,
          .kind = kind,
          .frame_id = "map",
          .grid = GridGeometry{PlanarTransform(1, 2, 0), 0.5}};
}

LayerSpec SemanticSpec(const std::string& name, const std::string& frame_id = "map") {
  return {.name = name, .kind = LayerKind::kSemantic, .frame_id = frame_id};
}

ExportedFiles Encode(const Snapshot& map) {
  absl::StatusOr<ExportedFiles> exported = EncodeHmap(map);
  EXPECT_TRUE(exported.ok()) << exported.status();
  return exported.ok() ? *std::move(exported) : ExportedFiles{{{"", ""}}, {}};
}

TEST(DecodeHmapTest, PutsPixelsWhereTheOriginalPutsThem) {
  const GreyAlphaImage image{
      3, 2, {{0, 255}, {255, 255}, {127, 0}, {204, 255}, {51, 255}, {255, 254}}};
  const Snapshot map = MapOf(Decode(OccupancyHmap(kOccupancyYaml, Png(image))));
  const Layer& layer = *map.FindLayer("occupancy");
  EXPECT_EQ(layer.ContentAt({1.25, 2.75}).value, 1.0);
  EXPECT_EQ(layer.ContentAt({1.75, 2.75}).value, 0.0);
  EXPECT_EQ(layer.ContentAt({2.25, 2.75}).status, AnswerStatus::kUnknown);
  EXPECT_EQ(layer.ContentAt({1.25, 2.25}).value, 0.2);
  EXPECT_EQ(layer.ContentAt({1.75, 2.25}).value, 0.8);
  EXPECT_EQ(layer.ContentAt({2.25, 2.25}).status, AnswerStatus::kUnknown);
  EXPECT_EQ(layer.ContentAt({2.55, 2.25}).status, AnswerStatus::kOutside);
}

TEST(DecodeHmapTest, IdsAreTheLoadOrder) {
  const ImportedMap imported =
      Decode(SemanticHmap("- {name: b, shape: 'POLYGON((0 0,1 0,0 1,0 0))'}\n"
                          "- {name: a, shape: 'POLYGON((5 5,6 5,5 6,5 5))'}\n"));
  EXPECT_THAT(imported.layers, ElementsAre("semantic"));
  const Snapshot map = MapOf(imported);
  EXPECT_EQ(dynamic_cast<const SemanticLayer&>(*map.FindLayer("semantic")).Find(1)->label, "b");
  EXPECT_EQ(dynamic_cast<const SemanticLayer&>(*map.FindLayer("semantic")).Find(2)->label, "a");
}

TEST(DecodeHmapTest, LayersWithoutFilesAreEmpty) {
  const Snapshot map = MapOf(Decode(
      Zip({{"hmap_config.yaml",
            "layers:\n"
            "  - {name: grid, frame_id: map, load_file: false, file: gone,"
            " class: OccupancyGridLayer}\n"
            "  - {name: objects, frame_id: odom, load_file: false, class: SemanticLayer}\n"}})));
  EXPECT_EQ(Grid(map, "grid").geometry(), GridGeometry());
  EXPECT_TRUE(Grid(map, "grid").extent().empty());
  EXPECT_THAT(Objects(map, "objects"), IsEmpty());
  EXPECT_EQ(map.FindLayer("objects")->spec().frame_id, "odom");
}

std::string FramesHmap(const std::vector<std::string>& frames, const std::string& transforms) {
  std::string config = "layers:\n";
  for (size_t i = 0; i < frames.size(); ++i) {
    absl::StrAppend(&config, "  - {name: l", i, ", frame_id: ", frames[i],
                    ", class: SemanticLayer}\n");
  }
  return Zip({{"hmap_config.yaml", config + transforms}});
}

TEST(DecodeHmapTest, TheMapsOwnFrameIsMapWhereTheFileUsesIt) {
  const std::string transform =
      "transforms:\n  - {frame_id: map, child_frame_id: odom, transform_pose: [1, 2, 0.5]}\n";
  EXPECT_EQ(Decode(FramesHmap({"odom", "map"}, "")).frame_id, "map");
  EXPECT_EQ(Decode(FramesHmap({"odom", "site"}, transform)).frame_id, "map");
  EXPECT_EQ(Decode(FramesHmap({"odom", "site"}, "")).frame_id, "odom");
  EXPECT_EQ(Decode(FramesHmap({"''"}, "")).frame_id, "map");
  EXPECT_EQ(Decode(Zip({{"hmap_config.yaml", "layers: []"}})).frame_id, "map");
  const Snapshot map = MapOf(Decode(FramesHmap({"odom"}, transform)));
  EXPECT_EQ(*map.frames.Lookup("map", "odom"), PlanarTransform(1, 2, 0.5));
}

TEST(EncodeHmapTest, WritesTheMembersThatTheOriginalReads) {
  SemanticObject chair = Object("chair");
  chair.tags = {"seat"};
  chair.classes = {{"seat", 0.5}};
  const Snapshot map =
      Made({CreateLayer{GridSpec("grid")}, WriteCells{"grid", {0, 1, 0, 2}, {0.25, std::nullopt}},
            CreateLayer{SemanticSpec("things")}, PutObject{"things", chair, ""},
            PutObject{"things", Object("cup"), ""}});
  const ExportedFiles exported = Encode(map);
  EXPECT_THAT(exported.omissions, IsEmpty());
  ASSERT_THAT(exported.files, SizeIs(1));
  EXPECT_EQ(exported.files[0].name, "site.hmap");
  ZipArchive archive = *ZipArchive::Open(exported.files[0].data, Limits());
  EXPECT_EQ(*archive.Read("hmap_config.yaml"),
            "layers:\n"
            "  - name: grid\n    frame_id: map\n    load_file: true\n    file: grid\n"
            "    class: OccupancyGridLayer\n"
            "  - name: things\n    frame_id: map\n    load_file: true\n    file: things\n"
            "    class: SemanticLayer\n");
  EXPECT_EQ(*archive.Read("grid.yaml"),
            "image: grid.png\nresolution: 0.5\norigin: [1, 2, 0]\nnegate: 0\n"
            "occupied_thresh: 1\nfree_thresh: 0\nmode: scale\n");
  EXPECT_EQ(*archive.Read("things"),
            "- name: chair\n  shape: POLYGON((0 0,2 0,2 2,0 0))\n  tags: [seat]\n"
            "  confidence: [0.5]\n"
            "- name: cup\n  shape: POLYGON((0 0,2 0,2 2,0 0))\n  tags: ~\n  confidence: ~\n");
  const absl::StatusOr<GreyAlphaImage> png = DecodeImage(*archive.Read("grid.png"), 100);
  ASSERT_TRUE(png.ok()) << png.status();
  EXPECT_THAT(png->pixels, ElementsAre(GreyAlpha{191, 255}, GreyAlpha{127, 0}));
}

TEST(EncodeHmapTest, ContentFramesAndTransformsComeBack) {
  const double pi = std::acos(-1.0);
  LayerSpec turned = GridSpec("turned");
  turned.frame_id = "odom";
  turned.grid->layer_from_grid = PlanarTransform(-3.7, 1.1, 0.3);
  LayerSpec first = GridSpec("a");
  first.frame_id = "odom";
  const Snapshot map = Made(
      {SetTransform{{"site", "odom", PlanarTransform(0.1, 0.2, pi)}}, CreateLayer{turned},
       WriteCells{"turned", {-3, -1, -5, -2}, {0, 0.01, 0.5, std::nullopt, 0.99, 1}},
       CreateLayer{SemanticSpec("objects", "site")}, PutObject{"objects", Object("Ruukku"), ""},
       CreateLayer{first}, CreateLayer{SemanticSpec("none", "odom")}},
      "site");
  const ExportedFiles exported = Encode(map);
  EXPECT_THAT(exported.omissions,
              ElementsAre("layer \"a\": its resolution and origin, being empty"));
  const ImportedMap imported = Decode(exported.files[0].data);
  EXPECT_THAT(imported.repairs, IsEmpty());
  EXPECT_EQ(imported.frame_id, "site");
  const Snapshot again = MapOf(imported);
  EXPECT_EQ(again.frames.transforms(), map.frames.transforms());
  EXPECT_EQ(Objects(again, "objects"), Objects(map, "objects"));
  EXPECT_EQ(again.FindLayer("objects")->spec().frame_id, "site");
  EXPECT_EQ(testing::Values(Grid(again, "turned")), testing::Values(Grid(map, "turned")));
  const Point corner = Grid(again, "turned").geometry().CentreOf({0, 0});
  const Point expected = Grid(map, "turned").geometry().CentreOf({-3, -5});
  EXPECT_NEAR(corner.x, expected.x, 1e-12);
  EXPECT_NEAR(corner.y, expected.y, 1e-12);
}

TEST(EncodeHmapTest, ExportOfAnImportIsTheSameFile) {
  const Snapshot map = Made(
      {CreateLayer{GridSpec("grid")}, WriteCells{"grid", {-2, 0, 3, 5}, {0.25, std::nullopt, 0, 1}},
       CreateLayer{SemanticSpec("things")}, PutObject{"things", Object("cup"), ""}});
  const std::string once = Encode(map).files[0].data;
  EXPECT_EQ(Encode(MapOf(Decode(once))).files[0].data, once);
}

TEST(EncodeHmapTest, TellsOfAliases) {
  const Snapshot map = Made({CreateLayer{SemanticSpec("things")},
                             SetAliases{"things", {{"tv", {"tvmonitor"}}, {"sofa", {"couch"}}}}});
  EXPECT_THAT(Encode(map).omissions, ElementsAre("layer \"things\": 2 aliases"));
}

TEST(EncodeHmapTest, TellsWhatTheFormatCanNotCarry) {
  SemanticObject rich = Object("chair");
  rich.existence = 0.5;
  rich.height = HeightRange{0, 1};
  rich.attributes["colour"] = std::string("red");
  rich.classes = {{"chair", 0.5}, {"stool", 0.5}};
  SemanticObject poorer = Object("chair");
  poorer.existence = 0.25;
  LayerSpec grid = GridSpec("grid");
  grid.thresholds = {0.1, 0.9};
  const Snapshot map =
      Made({CreateLayer{grid}, WriteCells{"grid", {0, 1, 0, 2}, {0.123, 0.5}},
            CreateLayer{SemanticSpec("things")}, PutObject{"things", rich, ""},
            PutObject{"things", poorer, ""}, CreateLayer{GridSpec("seen", LayerKind::kExploration)},
            CreateLayer{GridSpec("wifi", LayerKind::kScalar)}});
  EXPECT_THAT(
      Encode(map).omissions,
      ElementsAre(
          "layer \"grid\": its thresholds, free below 0.1 and occupied above 0.9",
          "layer \"grid\": 1 values rounded to 1/100",
          "layer \"seen\": left out, the format has no layers of the kind exploration",
          "layer \"things\": classes of 1, existence of 2, height of 1, attributes of 1 objects",
          "layer \"wifi\": left out, the format has no layers of the kind scalar"));
}

TEST(EncodeHmapTest, LeavesOutLinesAndPointsWithALineEach) {
  SemanticObject lane = Object("lane");
  lane.shape = *LineString::Make({{0, 0}, {8, 0}});
  SemanticObject dock = Object("dock");
  dock.shape = *Shape::MakePoint({2, 1});
  dock.existence = 0.5;
  LayerSpec docks = SemanticSpec("docks");
  docks.shape_kinds = {ShapeKind::kPoint};
  const Snapshot map =
      Made({CreateLayer{docks}, PutObject{"docks", dock, ""}, CreateLayer{SemanticSpec("things")},
            PutObject{"things", lane, ""}, PutObject{"things", dock, ""},
            PutObject{"things", Object("cup"), ""}, PutObject{"things", lane, ""}});
  const ExportedFiles exported = Encode(map);
  EXPECT_THAT(
      exported.omissions,
      ElementsAre(
          "layer \"docks\": 1 objects with points left out, the format has polygons only",
          "layer \"docks\": which kinds of shape it takes",
          "layer \"things\": 2 objects with line strings left out, the format has polygons only",
          "layer \"things\": 1 objects with points left out, the format has polygons only"));
  const Snapshot again = MapOf(Decode(exported.files[0].data));
  EXPECT_THAT(Objects(again, "docks"), IsEmpty());
  EXPECT_THAT(Objects(again, "things"), ElementsAre(Object("cup")));
}

TEST(EncodeHmapTest, LayersWhoseMembersWouldCollideAllComeBack) {
  const Snapshot map =
      Made({CreateLayer{GridSpec("a")}, WriteCells{"a", {0, 1, 0, 1}, {1}},
            CreateLayer{SemanticSpec("a.yaml")}, PutObject{"a.yaml", Object("cup"), ""},
            CreateLayer{SemanticSpec("hmap_config.yaml")}, CreateLayer{GridSpec("hmap_config")},
            WriteCells{"hmap_config", {0, 1, 0, 1}, {0}}, CreateLayer{SemanticSpec("a.png")}});
  const Snapshot again = MapOf(Decode(Encode(map).files[0].data));
  testing::ExpectSameContent(map, again);
}

TEST(EncodeHmapTest, AMapWithoutLayersComesBack) {
  const Snapshot empty = Made({SetTransform{{"map", "odom", PlanarTransform(1, 2, 3)}}});
  const ImportedMap imported = Decode(Encode(empty).files[0].data);
  EXPECT_THAT(imported.layers, IsEmpty());
  EXPECT_EQ(MapOf(imported).frames.transforms(), empty.frames.transforms());
}

}  // namespace
}  // namespace hypermap::storage
