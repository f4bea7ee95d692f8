#include "client_libs/cli/table_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "client_libs/cli/grid_summary.h"

namespace hypermap::cli {
namespace {

SemanticObject Object(ObjectId id, const std::string& label, const Point& corner) {
  return {.id = id,
          .label = label,
          .classes = {},
          .existence = 0.875,
          .shape = Polygon::FromBox({corner, {corner.x + 1, corner.y + 0.5}}),
          .height = std::nullopt,
          .tags = {"furniture"},
          .attributes = {}};
}

SemanticObject Lane() {
  SemanticObject lane = Object(11, "lane", {0, 0});
  lane.shape = *LineString::Make({{0, 0}, {4, 0}, {4, 4}});
  return lane;
}

SemanticObject Dock() {
  SemanticObject dock = Object(12, "dock", {0, 0});
  dock.shape = *Shape::MakePoint({2.5, -1});
  return dock;
}

template <typename Answer>
std::string AsTable(const Answer& answer) {
  std::ostringstream out;
  MakeTableOutput(out)->Show(answer);
  return out.str();
}

TEST(TableOutputTest, PointAnswerHasARowALayerOrObject) {
  EXPECT_EQ(AsTable(client::PointAnswer{
                "office",
                7,
                "map",
                {2.75, -0.4},
                {{"floor", LayerKind::kOccupancy, AnswerStatus::kValue, 0.02, {}},
                 {"objects",
                  LayerKind::kSemantic,
                  AnswerStatus::kValue,
                  std::nullopt,
                  {Object(4, "dining table", {2, 0}), Lane(), Dock()}},
                 {"parts", LayerKind::kSemantic, AnswerStatus::kValue, std::nullopt, {}},
                 {"seen", LayerKind::kExploration, AnswerStatus::kValue, 0.0, {}},
                 {"wifi", LayerKind::kScalar, AnswerStatus::kOutside, std::nullopt, {}}}}),
            "LAYER    KIND         ANSWER\n"
            "floor    occupancy    0.02\n"
            "objects  semantic     dining table (id 4), existence 0.88\n"
            "objects  semantic     lane (id 11), line string of 8 m, existence 0.88\n"
            "objects  semantic     dock (id 12), point, existence 0.88\n"
            "parts    semantic     nothing\n"
            "seen     exploration  unexplored\n"
            "wifi     scalar       outside of the layer\n"
            "(2.75, -0.4) in frame map, revision 7\n");
}

TEST(TableOutputTest, PartsAreObjectsThenSummariesOfGridsThenRefusals) {
  const GridGeometry geometry{PlanarTransform(10, 0, 0), 0.5};
  std::ostringstream out;
  const auto output = MakeTableOutput(out);
  output->Show(client::LayerPart{"floor",
                                 LayerKind::kOccupancy,
                                 AnswerStatus::kValue,
                                 {},
                                 geometry,
                                 {{0, 0, 3, 0.25}, {1, 0, 1, 1.0}}});
  output->Show(client::LayerPart{"floor",
                                 LayerKind::kOccupancy,
                                 AnswerStatus::kValue,
                                 {},
                                 geometry,
                                 {{2, 0, 4, std::nullopt}}});
  output->Show(
      client::LayerPart{"objects",
                        LayerKind::kSemantic,
                        AnswerStatus::kValue,
                        {Object(9, "bed", {1, 1}), Object(10, "toilet", {-3, 1}), Lane(), Dock()},
                        std::nullopt,
                        {}});
  output->Show(client::LayerPart{
      "wifi", LayerKind::kScalar, AnswerStatus::kUnsupportedValue, {}, std::nullopt, {}});
  output->Show(client::LayerPart{
      "dock", LayerKind::kSemantic, AnswerStatus::kUnsupportedValue, {}, std::nullopt, {}});
  output->EndParts(5);
  EXPECT_EQ(out.str(),
            "LAYER    ID  LABEL   EXISTENCE  X [m]  Y [m]  SHAPE        EXTENT  TAGS\n"
            "objects   9  bed          0.88    1.5   1.25  polygon      0.5 m²  furniture\n"
            "objects  10  toilet       0.88   -2.5   1.25  polygon      0.5 m²  furniture\n"
            "objects  11  lane         0.88      3      1  line_string  8 m     furniture\n"
            "objects  12  dock         0.88    2.5     -1  point                furniture\n"
            "\n"
            "LAYER  CELLS  AREA [m²]  VALUES                               WITHIN [m]\n"
            "floor      8          2  0.25 to 1, mean 0.438; 1 m² unknown  (10, 0) to (12, 1.5)\n"
            "does not support this value: wifi, dock\n"
            "4 objects, 8 cells, revision 5\n");
}

TEST(TableOutputTest, NoMatchesIsALine) {
  std::ostringstream out;
  MakeTableOutput(out)->EndParts(5);
  EXPECT_EQ(out.str(), "nothing, revision 5\n");
}

client::LayerEntry Entry(LayerSpec spec) {
  client::LayerEntry entry;
  entry.spec = std::move(spec);
  entry.properties = PropertiesOf(entry.spec);
  return entry;
}

TEST(TableOutputTest, LayersTellTheirRuleTheirShapesAndTheirUnit) {
  const client::LayerList layers{
      "office",
      4,
      {Entry({.name = "floor", .kind = LayerKind::kOccupancy, .frame_id = "map"}),
       Entry({.name = "lanes",
              .kind = LayerKind::kSemantic,
              .frame_id = "map",
              .shape_kinds = {ShapeKind::kPoint, ShapeKind::kLineString}}),
       Entry({.name = "seen",
              .kind = LayerKind::kExploration,
              .frame_id = "map",
              .explored_rule = CellRule::kTouched}),
       Entry({.name = "things", .kind = LayerKind::kSemantic, .frame_id = "map"}),
       Entry({.name = "wifi", .kind = LayerKind::kScalar, .frame_id = "map", .unit = "dBm"})}};
  EXPECT_EQ(
      AsTable(layers),
      "LAYER   KIND                  FRAME  SIZE       SHAPES              CELL [m]  GRID ORIGIN  "
      "UNIT\n"
      "floor   occupancy             map    0 cells\n"
      "lanes   semantic              map    0 objects  line_string, point\n"
      "seen    exploration, touched  map    0 cells\n"
      "things  semantic              map    0 objects  all\n"
      "wifi    scalar                map    0 cells                                               "
      "dBm\n"
      "5 layers, revision 4\n");
}

TEST(TableOutputTest, AChangeOfALayerTellsTheShapesThatItIsLimitedTo) {
  client::WatchEvent event;
  event.revision = 9;
  event.time = absl::UnixEpoch();
  event.changes.resize(2);
  event.changes[0] = {
      .kind = ChangeKind::kLayerCreated,
      .layer = "lanes",
      .layer_now = LayerStructure{
          {.name = "lanes", .shape_kinds = {ShapeKind::kPoint, ShapeKind::kLineString}}}};
  event.changes[1] = {.kind = ChangeKind::kLayerCreated,
                      .layer = "things",
                      .layer_now = LayerStructure{{.name = "things"}}};
  EXPECT_EQ(AsTable(event),
            "9  1970-01-01 00:00:00.000Z  lanes  layer_created  semantic of line_string, point\n"
            "9  1970-01-01 00:00:00.000Z  things  layer_created  semantic\n");
}

TEST(TableOutputTest, NearestHasDistances) {
  client::NearestAnswer answer{"office", 3, "map", {}, {}};
  answer.matches.push_back({"objects", LayerKind::kSemantic, 0.75, Object(4, "cup", {2, 0}),
                            std::nullopt, std::nullopt});
  answer.matches.push_back({"seen", LayerKind::kExploration, 1.5, std::nullopt,
                            GridGeometry{PlanarTransform(), 0.5}, CellRun{0, 3, 4, 0.0}});
  EXPECT_EQ(AsTable(answer),
            "DISTANCE [m]  LAYER    WHAT                        X [m]  Y [m]\n"
            "        0.75  objects  cup (id 4), existence 0.88    2.5   0.25\n"
            "         1.5  seen     cell: unexplored             1.75   0.25\n"
            "2 places, revision 3\n");
}

TEST(TableOutputTest, AnImportListsTheFirstRepairs) {
  client::ImportAnswer answer{"office", 2, {"floor", "objects"}, {"ring left open"}};
  EXPECT_EQ(AsTable(answer),
            "office: floor, objects written, revision 2\n"
            "repaired: ring left open\n");
  answer.repairs.assign(12, "ring left open");
  EXPECT_THAT(AsTable(answer),
              ::testing::EndsWith("repaired: ring left open\n"
                                  "and 2 other repairs (--json lists them all)\n"));
}

TEST(TableOutputTest, MapsThatCannotBeOpenedSayWhy) {
  client::MapEntry office{"office", "map", 4, absl::FromUnixSeconds(0), 2, ""};
  client::MapEntry broken;
  broken.name = "broken";
  broken.problem = "not a GeoPackage\nat all";
  broken.state = MapState::kClosed;
  client::MapEntry full{"full", "map", 4, absl::FromUnixSeconds(0), 2, "disk is full"};
  full.state = MapState::kReadOnly;
  EXPECT_EQ(
      AsTable(std::vector<client::MapEntry>{broken, full, office}),
      "MAP     FRAME  REVISION  LAYERS  CREATED               STATE      PROBLEM\n"
      "broken                                                 closed     not a GeoPackage at all\n"
      "full    map           4       2  1970-01-01 00:00:00Z  read_only  disk is full\n"
      "office  map           4       2  1970-01-01 00:00:00Z  serving\n");
  EXPECT_EQ(AsTable(std::vector<client::MapEntry>{}), "no maps\n");
}

TEST(TableOutputTest, ALogIsTheNewestRevisions) {
  EXPECT_EQ(AsTable(client::RevisionList{"office", 12, 2, {{12, absl::UnixEpoch(), "cart", 3}}}),
            "REVISION  TIME                      AUTHOR  CHANGES\n"
            "      12  1970-01-01 00:00:00.000Z  cart          3\n"
            "office: kept from revision 2, revision 12\n");
}

TEST(TableOutputTest, AWatchIsALineAChange) {
  client::WatchEvent event;
  event.revision = 9;
  event.time = absl::UnixEpoch();
  event.changes.resize(2);
  event.changes[0] = {.kind = ChangeKind::kEnter,
                      .layer = "objects",
                      .object_id = 4,
                      .object = std::make_shared<SemanticObject>(Object(4, "cup", {2, 0}))};
  event.changes[1] = {.kind = ChangeKind::kRemove, .layer = "objects", .object_id = 5};
  EXPECT_EQ(AsTable(event),
            "9  1970-01-01 00:00:00.000Z  objects  enter  cup (id 4), existence 0.88 at (2.5, "
            "0.25)\n"
            "9  1970-01-01 00:00:00.000Z  objects  remove  object 5\n");
}

TEST(TableOutputTest, ACallerHasARow) {
  EXPECT_EQ(AsTable(client::CallerAnswer{.has_identities = true,
                                         .identity = "cart",
                                         .role = access::Role::kRobot,
                                         .maps = {"hall-*", "office"},
                                         .robots = {"cart-arm"},
                                         .expires = absl::InfiniteFuture()}),
            "IDENTITY  ROLE   MAPS           ROBOTS    EXPIRES\n"
            "cart      robot  hall-* office  cart-arm  never\n");
  EXPECT_EQ(AsTable(client::CallerAnswer()),
            "the server knows no identities: everybody may do everything\n");
}

TEST(TableOutputTest, ServersAndTheirMapsHaveRows) {
  EXPECT_EQ(
      AsTable(client::ServerList{
          "b",
          {{"a", "10.0.0.1:50051", 1}, {"b", "10.0.0.2:50051", 0, true}},
          {{"attic", "", 3, std::nullopt, 7}, {"office", "a", 9, 7, 8}, {"yard", "a", 5, 6, 9}}}),
      "SERVER  ADDRESS         MAPS  STATE\n"
      "a       10.0.0.1:50051     1  -\n"
      "b       10.0.0.2:50051     0  draining\n"
      "\n"
      "MAP     OWNER  REVISION  LAG OF b\n"
      "attic   -             3  -\n"
      "office  a             9  2\n"
      "yard    a             5  0\n");
}

TEST(TableOutputTest, AServerTellsWhetherItIsDrained) {
  EXPECT_EQ(AsTable(ServerState{"a", true}), "a owns no map\n");
  EXPECT_EQ(AsTable(ServerState{"a", false}), "a may own maps\n");
}

TEST(GridSummaryTest, NamesTheValuesOfTheKind) {
  GridSummary seen({"seen",
                    LayerKind::kExploration,
                    AnswerStatus::kValue,
                    {},
                    GridGeometry{PlanarTransform(), 0.5},
                    {}});
  EXPECT_EQ(seen.DescribeValues(), "");
  EXPECT_EQ(seen.DescribeExtent(), "");
  seen.Add({-1, 0, 3, 1.0});
  EXPECT_EQ(seen.DescribeValues(), "explored");
  EXPECT_EQ(seen.DescribeExtent(), "(0, -0.5) to (1.5, 0)");
  seen.Add({0, 0, 1, 0.0});
  EXPECT_EQ(seen.DescribeValues(), "75 % explored");
  EXPECT_EQ(seen.Area(), 1.0);
}

}  // namespace
}  // namespace hypermap::cli
