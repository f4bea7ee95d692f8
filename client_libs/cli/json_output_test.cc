#include "client_libs/cli/json_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

namespace hypermap::cli {
namespace {

using ::testing::HasSubstr;

SemanticObject Cup() {
  return {
      .id = 12,
      .label = "cup",
      .classes = {{"bowl", 0.1}, {"cup", 0.81}},
      .existence = 0.97,
      .shape = *Polygon::Make({{0, 0}, {4, 0}, {4, 4}, {0, 4}}, {{{1, 1}, {1, 3}, {3, 3}, {3, 1}}}),
      .height = HeightRange{0.7, 0.8},
      .tags = {"blue", "mine"},
      .attributes = {{"clean", false},
                     {"owner", std::string("Ada")},
                     {"uses", int64_t{3}},
                     {"weight_kg", 0.25}},
      .expires_at = absl::FromUnixSeconds(60),
      .version = 7};
}

SemanticObject Plain(ObjectId id, const std::string& label) {
  return {.id = id,
          .label = label,
          .classes = {},
          .existence = 1.0,
          .shape = Polygon::FromBox({{0, 0}, {1, 1}}),
          .height = std::nullopt,
          .tags = {},
          .attributes = {},
          .expires_at = {}};
}

client::LayerPart GridPart(const std::string& layer, LayerKind kind, std::vector<CellRun> runs) {
  return {layer,
          kind,
          AnswerStatus::kValue,
          {},
          GridGeometry{PlanarTransform(-1.5, 2, 0.25), 0.05},
          std::move(runs)};
}

client::LayerPart ObjectsPart(const std::string& layer, std::vector<SemanticObject> objects) {
  return {layer, LayerKind::kSemantic, AnswerStatus::kValue, std::move(objects), std::nullopt, {}};
}

// The output for one answer.
template <typename Answer>
std::string AsJson(const Answer& answer) {
  std::ostringstream out;
  MakeJsonOutput(out)->Show(answer);
  return out.str();
}

std::string ShownParts(const std::vector<client::LayerPart>& parts, Revision revision) {
  std::ostringstream out;
  const auto output = MakeJsonOutput(out);
  for (const client::LayerPart& part : parts) output->Show(part);
  output->EndParts(revision);
  return out.str();
}

TEST(JsonOutputTest, EntityHasAllOfAnObjectWithClosedRings) {
  EXPECT_EQ(ShownParts({ObjectsPart("objects", {Cup()})}, 3),
            R"({"layer":"objects","entity":{"id":12,"label":"cup",)"
            R"("classes":{"bowl":0.1,"cup":0.81},"existence":0.97,)"
            R"("polygon":[[[0.0,0.0],[4.0,0.0],[4.0,4.0],[0.0,4.0],[0.0,0.0]],)"
            R"([[1.0,1.0],[1.0,3.0],[3.0,3.0],[3.0,1.0],[1.0,1.0]]],)"
            R"("centroid":[2.0,2.0],"tags":["blue","mine"],)"
            R"("attributes":{"clean":false,"owner":"Ada","uses":3,"weight_kg":0.25},)"
            R"("height":[0.7,0.8],"expires_at":"1970-01-01T00:01:00+00:00"}})"
            "\n"
            R"({"revision":3})"
            "\n");
}

TEST(JsonOutputTest, AnEntityHasTheCoordinatesOfItsKindOfShape) {
  SemanticObject lane = Plain(3, "lane");
  lane.shape = *LineString::Make({{0, 0}, {4, 0}, {4, 4}});
  SemanticObject dock = Plain(4, "dock");
  dock.shape = *Shape::MakePoint({2.5, -1});
  EXPECT_EQ(ShownParts({ObjectsPart("lanes", {Plain(2, "pad"), lane, dock})}, 3),
            R"({"layer":"lanes","entity":{"id":2,"label":"pad","classes":{},"existence":1.0,)"
            R"("polygon":[[[0.0,0.0],[1.0,0.0],[1.0,1.0],[0.0,1.0],[0.0,0.0]]],)"
            R"("centroid":[0.5,0.5],"tags":[],"attributes":{},"height":null}})"
            "\n"
            R"({"layer":"lanes","entity":{"id":3,"label":"lane","classes":{},"existence":1.0,)"
            R"("line_string":[[0.0,0.0],[4.0,0.0],[4.0,4.0]],)"
            R"("centroid":[3.0,1.0],"tags":[],"attributes":{},"height":null}})"
            "\n"
            R"({"layer":"lanes","entity":{"id":4,"label":"dock","classes":{},"existence":1.0,)"
            R"("point":[2.5,-1.0],"centroid":[2.5,-1.0],"tags":[],"attributes":{},)"
            R"("height":null}})"
            "\n"
            R"({"revision":3})"
            "\n");
}

TEST(JsonOutputTest, WhatAnObjectLacksIsEmptyOrNull) {
  const auto json = nlohmann::json::parse(AsJson(ObjectsPart("objects", {Plain(1, "rug")})));
  const auto& entity = json["entity"];
  EXPECT_EQ(entity["classes"], nlohmann::json::object());
  EXPECT_EQ(entity["tags"], nlohmann::json::array());
  EXPECT_EQ(entity["attributes"], nlohmann::json::object());
  EXPECT_TRUE(entity["height"].is_null());
}

TEST(JsonOutputTest, PointAnswerHasEveryKeyForEveryLayer) {
  const client::PointAnswer answer{
      "office",
      7,
      "map",
      {2.75, -0.4},
      {{"dock", LayerKind::kSemantic, AnswerStatus::kNoTransform, std::nullopt, {}},
       {"floor", LayerKind::kOccupancy, AnswerStatus::kValue, 0.02, {}},
       {"objects", LayerKind::kSemantic, AnswerStatus::kValue, std::nullopt, {Plain(4, "rug")}},
       {"seen", LayerKind::kExploration, AnswerStatus::kValue, 1.0, {}},
       {"wifi", LayerKind::kScalar, AnswerStatus::kUnknown, std::nullopt, {}}}};
  auto json = nlohmann::json::parse(AsJson(answer));
  EXPECT_EQ(json["layers"][2]["entities"][0]["label"], "rug");
  json["layers"][2]["entities"] = nlohmann::json::array();
  EXPECT_EQ(json, nlohmann::json::parse(R"({"map":"office","revision":7,"frame_id":"map",
      "point":[2.75,-0.4],"layers":[
      {"layer":"dock","kind":"semantic","status":"no_transform","value":null,"entities":[]},
      {"layer":"floor","kind":"occupancy","status":"value","value":0.02,"entities":[]},
      {"layer":"objects","kind":"semantic","status":"value","value":null,"entities":[]},
      {"layer":"seen","kind":"exploration","status":"value","value":1,"entities":[]},
      {"layer":"wifi","kind":"scalar","status":"unknown","value":null,"entities":[]}]})"));
}

TEST(JsonOutputTest, RunsOfALayerAreOneLineWhateverPartsTheyCameIn) {
  EXPECT_EQ(ShownParts({GridPart("floor", LayerKind::kOccupancy, {{-2, -1, 3, 0.02}}),
                        GridPart("floor", LayerKind::kOccupancy, {}),
                        GridPart("floor", LayerKind::kOccupancy, {{0, 5, 6, std::nullopt}}),
                        GridPart("seen", LayerKind::kExploration, {{1, 2, 3, 1.0}})},
                       8),
            R"({"layer":"floor","grid":{"origin":[-1.5,2.0,0.25],"resolution_m":0.05},)"
            R"("runs":[[-2,-1,3,0.02],[0,5,6,null]]})"
            "\n"
            R"({"layer":"seen","grid":{"origin":[-1.5,2.0,0.25],"resolution_m":0.05},)"
            R"("runs":[[1,2,3,1]]})"
            "\n"
            R"({"revision":8})"
            "\n");
}

TEST(JsonOutputTest, AGridWithoutMatchesHasALineAndASemanticLayerNone) {
  EXPECT_EQ(
      ShownParts({GridPart("floor", LayerKind::kOccupancy, {}), ObjectsPart("objects", {})}, 1),
      R"({"layer":"floor","grid":{"origin":[-1.5,2.0,0.25],"resolution_m":0.05},"runs":[]})"
      "\n"
      R"({"revision":1})"
      "\n");
}

TEST(JsonOutputTest, ALayerThatCannotAnswerSaysWhy) {
  EXPECT_EQ(
      ShownParts(
          {{"wifi", LayerKind::kScalar, AnswerStatus::kUnsupportedValue, {}, std::nullopt, {}}}, 1),
      R"({"layer":"wifi","status":"unsupported_value"})"
      "\n"
      R"({"revision":1})"
      "\n");
}

TEST(JsonOutputTest, NearestHasALineAPlaceThenTheRefusals) {
  client::NearestAnswer answer{"office", 3, "map", {}, {{"wifi", AnswerStatus::kNoTransform}}};
  answer.matches.push_back({"seen", LayerKind::kExploration, 0.5, std::nullopt,
                            GridGeometry{PlanarTransform(), 0.1}, CellRun{2, 3, 4, 0.0}});
  EXPECT_EQ(AsJson(answer),
            R"({"layer":"seen","distance_m":0.5,)"
            R"("grid":{"origin":[0.0,0.0,0.0],"resolution_m":0.1},"runs":[[2,3,4,0]]})"
            "\n"
            R"({"layer":"wifi","status":"no_transform"})"
            "\n"
            R"({"revision":3})"
            "\n");

  answer = {"office", 3, "map", {}, {}};
  answer.matches.push_back(
      {"objects", LayerKind::kSemantic, 1.25, Plain(4, "rug"), std::nullopt, std::nullopt});
  EXPECT_THAT(AsJson(answer),
              HasSubstr(R"({"layer":"objects","distance_m":1.25,"entity":{"id":4,"label":"rug")"));
}

TEST(JsonOutputTest, NumbersReadBackAsTheSameDouble) {
  for (const double value : {0.1, 1.0 / 3, 5e-324, 1.7976931348623157e308, -0.0, 123456789.125}) {
    const auto json =
        nlohmann::json::parse(AsJson(client::PointAnswer{"m", 1, "map", {value, 0}, {}}));
    EXPECT_EQ(json["point"][0].get<double>(), value);
  }
}

TEST(JsonOutputTest, WhatIsNotFiniteIsNull) {
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(AsJson(GridPart("wifi", LayerKind::kScalar, {})), "");
    EXPECT_THAT(ShownParts({GridPart("wifi", LayerKind::kScalar, {{0, 0, 1, value}})}, 1),
                HasSubstr("[[0,0,1,null]]"));
  }
}

TEST(JsonOutputTest, TextThatIsNoUtf8IsReplaced) {
  EXPECT_THAT(AsJson(client::ImportAnswer{"m", 1, {}, {"bad \xff byte"}}),
              HasSubstr("bad \xEF\xBF\xBD byte"));
}

TEST(JsonOutputTest, CatalogAnswers) {
  client::MapEntry office{
      "office", "map", 4, absl::FromUnixSeconds(0), 2, "", 18'446'744'073'709'551'615u};
  client::MapEntry broken;
  broken.name = "broken";
  broken.problem = "not a GeoPackage";
  broken.state = MapState::kClosed;
  EXPECT_EQ(AsJson(std::vector<client::MapEntry>{broken, office}),
            R"({"maps":[{"name":"broken","state":"closed","problem":"not a GeoPackage"},)"
            R"({"name":"office","frame_id":"map","revision":4,)"
            R"("create_time":"1970-01-01T00:00:00+00:00","layer_count":2,)"
            R"("incarnation":"18446744073709551615","state":"serving"}]})"
            "\n");
  EXPECT_EQ(AsJson(std::vector<client::MapEntry>{}), "{\"maps\":[]}\n");

  client::LayerEntry floor;
  floor.spec.name = "floor";
  floor.spec.kind = LayerKind::kOccupancy;
  floor.spec.frame_id = "map";
  floor.spec.grid = GridGeometry{PlanarTransform(), 0.05};
  floor.size = 6;
  floor.extent = CellBox{-1, 2, 0, 2};
  floor.version = 3;
  floor.properties = PropertiesOf(floor.spec);
  EXPECT_EQ(
      AsJson(client::LayerList{"office", 4, {floor}}),
      R"({"map":"office","revision":4,"layers":[{"name":"floor","kind":"occupancy",)"
      R"("frame_id":"map","size":6,"version":3,"grid":{"origin":[0.0,0.0,0.0],"resolution_m":0.05},)"
      R"("extent":{"rows":[-1,2],"cols":[0,2]},)"
      R"("thresholds":{"free_below":0.196,"occupied_above":0.65},"unit":"",)"
      R"("properties":{"has_cells":true,"has_shapes":false,"unit":"","value_range":[0.0,1.0],)"
      R"("words":["free","occupied","unknown"],"is_binary":false}}]})"
      "\n");
  client::LayerEntry seen;
  seen.spec.kind = LayerKind::kExploration;
  seen.spec.explored_rule = CellRule::kCovered;
  EXPECT_EQ(nlohmann::json::parse(
                AsJson(client::LayerList{"office", 4, {seen}}))["layers"][0]["explored_rule"],
            "covered");
  EXPECT_EQ(AsJson(client::TransformList{
                "office", 4, "map", {{"map", "dock", PlanarTransform(20, 0, 1.75)}}}),
            R"({"map":"office","revision":4,"frame_id":"map","transforms":[)"
            R"({"parent_frame_id":"map","child_frame_id":"dock",)"
            R"("parent_from_child":[20.0,0.0,1.75]}]})"
            "\n");
}

TEST(JsonOutputTest, ALayerOfObjectsListsItsKindsOfShape) {
  client::LayerEntry lanes;
  lanes.spec = {.name = "lanes", .kind = LayerKind::kSemantic, .frame_id = "map"};
  lanes.spec.shape_kinds = {ShapeKind::kPoint, ShapeKind::kLineString};
  lanes.properties = PropertiesOf(lanes.spec);
  EXPECT_EQ(
      AsJson(client::LayerList{"office", 4, {lanes}}),
      R"({"map":"office","revision":4,"layers":[{"name":"lanes","kind":"semantic",)"
      R"("frame_id":"map","size":0,"version":0,"aliases":{},"shape_kinds":["line_string","point"],)"
      R"("properties":{"has_cells":false,"has_shapes":true,"unit":"","value_range":null,)"
      R"("words":[],"is_binary":false}}]})"
      "\n");
}

TEST(JsonOutputTest, MutationsAndFiles) {
  EXPECT_EQ(AsJson(client::ImportAnswer{"office", 2, {"floor"}, {}}),
            "{\"map\":\"office\",\"revision\":2,\"layers\":[\"floor\"],\"repairs\":[]}\n");
  EXPECT_EQ(AsJson(Done{"office", "created", "floor", 2}),
            "{\"map\":\"office\",\"layer\":\"floor\",\"revision\":2}\n");
  EXPECT_EQ(AsJson(Done{"office", "deleted", "", 0}), "{\"map\":\"office\"}\n");
  EXPECT_EQ(
      AsJson(WrittenFiles{"office", 2, {"a.hmap"}, {"wifi"}}),
      "{\"map\":\"office\",\"revision\":2,\"files\":[\"a.hmap\"],\"omissions\":[\"wifi\"]}\n");
}

TEST(JsonOutputTest, AWatchIsALineAChange) {
  client::WatchEvent commit;
  commit.revision = 9;
  commit.time = absl::FromUnixMillis(60'250);
  commit.author = "cart";
  commit.changes.resize(4);
  commit.changes[0] = {.kind = ChangeKind::kLeave, .layer = "objects", .object_id = 4};
  commit.changes[1] = {.kind = ChangeKind::kCells,
                       .layer = "floor",
                       .grid = GridGeometry{PlanarTransform(1, 2, 0), 0.5},
                       .cells = {{-1, 0, 3, 1.0}, {2, 5, 6, std::nullopt}}};
  commit.changes[2] = {.kind = ChangeKind::kLayerDeleted, .layer = "wifi"};
  commit.changes[3] = {.kind = ChangeKind::kTransform,
                       .transform = FrameTransform{"map", "dock", PlanarTransform(3, 0, 0)}};
  const std::string when =
      R"({"revision":9,"time":"1970-01-01T00:01:00.25+00:00","author":"cart",)";
  EXPECT_EQ(AsJson(commit), when + R"("layer":"objects","op":"leave","id":4})" + "\n" + when +
                                R"("layer":"floor","op":"cells","grid":{"origin":[1.0,2.0,0.0],)" +
                                R"("resolution_m":0.5},"runs":[[-1,0,3,1.0],[2,5,6,null]]})" +
                                "\n" + when + R"("layer":"wifi","op":"layer_deleted"})" + "\n" +
                                when + R"("op":"transform","transform":{"parent_frame_id":"map",)" +
                                R"("child_frame_id":"dock","parent_from_child":[3.0,0.0,0.0]}})" +
                                "\n");

  client::WatchEvent progress;
  progress.revision = 12;
  EXPECT_EQ(AsJson(progress), "{\"revision\":12}\n");
}

TEST(JsonOutputTest, ASnapshotHasAnEndAndMayTakeBackWhatWasTold) {
  client::WatchEvent snapshot;
  snapshot.revision = 9;
  snapshot.snapshot = true;
  snapshot.reset = true;
  snapshot.changes = {{.kind = ChangeKind::kPut,
                       .layer = "objects",
                       .object_id = 3,
                       .object = std::make_shared<SemanticObject>(Plain(3, "cup"))}};
  const std::string shown = AsJson(snapshot);
  EXPECT_THAT(shown, ::testing::StartsWith(
                         "{\"revision\":9,\"reset\":true}\n{\"revision\":9,\"snapshot\":true,"
                         "\"layer\":\"objects\",\"op\":\"put\",\"id\":3,\"entity\":{\"id\":3,"));
  EXPECT_THAT(shown, ::testing::EndsWith("}\n{\"revision\":9}\n"));
}

TEST(JsonOutputTest, ADifferenceTellsBeforeAndAfter) {
  std::ostringstream out;
  auto output = MakeJsonOutput(out);
  output->Show(DifferenceChange{7,
                                absl::UnixEpoch(),
                                {.kind = ChangeKind::kCells,
                                 .layer = "floor",
                                 .grid = GridGeometry{PlanarTransform(), 0.5},
                                 .cells = {{0, 0, 3, 1.0}},
                                 .cells_before = {{0, 0, 3, std::nullopt}}}});
  output->EndDifference(2, 7);
  EXPECT_EQ(out.str(),
            R"({"revision":7,"time":"1970-01-01T00:00:00+00:00","layer":"floor","op":"cells",)"
            R"("grid":{"origin":[0.0,0.0,0.0],"resolution_m":0.5},"runs":[[0,0,3,1.0]],)"
            R"("runs_before":[[0,0,3,null]]})"
            "\n{\"from_revision\":2,\"revision\":7}\n");
}

TEST(JsonOutputTest, ALogListsRevisions) {
  EXPECT_EQ(AsJson(client::RevisionList{"office", 9, 2, {{9, absl::UnixEpoch(), "cart", 12}}}),
            R"({"map":"office","newest_revision":9,"oldest_revision":2,"revisions":[)"
            R"({"revision":9,"time":"1970-01-01T00:00:00+00:00","author":"cart","changes":12}]})"
            "\n");
}

TEST(JsonOutputTest, ServersHaveTheirMaps) {
  EXPECT_EQ(
      AsJson(client::ServerList{"b",
                                {{"a", "10.0.0.1:50051", 1, true}},
                                {{"attic", "", 3, std::nullopt, 7}, {"office", "a", 9, 7, 8}}}),
      R"({"answered_by":"b","servers":[{"id":"a","address":"10.0.0.1:50051","maps":1,"draining":true}],)"
      R"("maps":[{"name":"attic","owner":"","stored_revision":3,"incarnation":"7"},)"
      R"({"name":"office","owner":"a","stored_revision":9,"incarnation":"8","revision":7,)"
      R"("lag":2}]})"
      "\n");
}

TEST(JsonOutputTest, AServerTellsWhetherItIsDrained) {
  EXPECT_EQ(AsJson(ServerState{"a", true}), "{\"server\":\"a\",\"draining\":true}\n");
}

TEST(JsonOutputTest, ACallerHasItsRights) {
  EXPECT_EQ(
      AsJson(client::CallerAnswer{.has_identities = true,
                                  .identity = "anna",
                                  .role = access::Role::kEditor,
                                  .maps = {"hall-*", "office"},
                                  .robots = {},
                                  .expires = absl::UnixEpoch()}),
      R"({"has_identities":true,"identity":"anna","role":"editor","maps":["hall-*","office"],)"
      R"("robots":[],"expires":"1970-01-01T00:00:00+00:00"})"
      "\n");
  EXPECT_EQ(AsJson(client::CallerAnswer()), "{\"has_identities\":false}\n");
}

}  // namespace
}  // namespace hypermap::cli
