// Tests of the command render: requests, output and errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "client_libs/cli/canvas.h"
#include "client_libs/cli/testing/image.h"
#include "client_libs/cli/testing/run.h"
#include "client_libs/testing/scripted_server.h"
#include "google/protobuf/text_format.h"

namespace hypermap::cli {
namespace {

using client::Script;
using client::ScriptedServer;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

v1::LayerPart Part(const std::string& text) {
  v1::LayerPart part;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &part));
  return part;
}

// Two free cells of 1 m with an unknown cell on their right, and a chair above them.
Script Site() {
  Script script;
  script.revision = 7;
  script.parts = {
      Part("layer: 'adrift' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_NO_TRANSFORM"),
      Part("layer: 'floor' kind: LAYER_KIND_OCCUPANCY status: ANSWER_STATUS_VALUE "
           "cells { grid { origin { } resolution_m: 1 } rows: [0, 0] col_begins: [0, 2] "
           "col_ends: [2, 9] values: [0, nan] }"),
      Part("layer: 'things' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE "
           "objects { id: 1 label: 'chair' existence: 0.9 shape { polygon { outer { "
           "xs: [1, 2, 2, 1] ys: [2, 2, 4, 4] } } } }")};
  return script;
}

class RenderTest : public ::testing::Test {
 protected:
  Outcome Render(const ScriptedServer& server, Args args) {
    args.insert(args.begin(), {"render", "office", "-o", path_});
    return RunOn(server, args);
  }

  testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "map.png";
};

TEST_F(RenderTest, DrawsAllThatIsKnown) {
  ScriptedServer server(Site());
  const Outcome outcome = Render(server, {"--json"});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(folder_.Names(), ElementsAre("map.png"));
  const Pixels pixels(Get(path_));
  EXPECT_EQ(json::parse(outcome.out), (json{{"map", "office"},
                                            {"revision", 7},
                                            {"file", path_},
                                            {"width", pixels.width()},
                                            {"height", pixels.height()},
                                            {"layers", {"floor", "things"}},
                                            {"objects", 1}}));
  // The picture shows (0, 0) to (2, 4) and is 1600 pixels high.
  const auto at = [&pixels](double x, double y) {
    return pixels.At(static_cast<int>(kMargin + 400 * x),
                     static_cast<int>(kMargin + 400 * (4 - y)));
  };
  EXPECT_EQ(at(1.5, 0.5), 0xF8F8F8u);
  EXPECT_EQ(at(0.5, 3.0), 0xFFFFFFu);
  EXPECT_NE(at(1.5, 3.0), 0xFFFFFFu);
  EXPECT_THAT(server.Requests(),
              ElementsAre("ListLayers map: \"office\"",
                          StartsWith("QueryArea scope { map: \"office\" } area"),
                          StartsWith("QueryArea scope { map: \"office\" layers: \"floor\" } "
                                     "as_of { at_revision: 7 } area")));
}

TEST_F(RenderTest, AsksForTheLayersTheAreaAndTheRevisionThatAreWanted) {
  ScriptedServer server(Site());
  const Outcome outcome = Render(server, {"--layers", "floor,things", "--area", "0,0", "3,0", "3,1",
                                          "--pixels_per_m", "100", "--at", "5"});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(
      server.Requests()[1],
      StartsWith("QueryArea scope { map: \"office\" layers: \"floor\" layers: \"things\" } "
                 "as_of { at_revision: 5 } area { outer { xs: 0 xs: 3 xs: 3 ys: 0 ys: 0 ys: 1 "));
  EXPECT_EQ(Pixels(Get(path_)).At(static_cast<int>(kMargin) + 150, static_cast<int>(kMargin) + 100),
            0x0040E6u)
      << "the lower border of the area";
}

TEST_F(RenderTest, TellsPeopleWhatWasDrawnAndWhatNot) {
  ScriptedServer server(Site());
  const Outcome outcome = Render(server, {});
  EXPECT_THAT(outcome.out, StartsWith("wrote " + path_ + ", "));
  EXPECT_THAT(outcome.out, HasSubstr("no transform to its frame: adrift\n"));
  EXPECT_THAT(outcome.out, HasSubstr("office: floor, things; 1 object, revision 7\n"));
}

TEST_F(RenderTest, DrawsExplorationsAndPaths) {
  Script script = Site();
  script.parts.insert(
      script.parts.begin(),
      Part("layer: 'explorations' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE "
           "objects { id: 2 label: 'exploration' shape { polygon { outer { xs: [0, 2, 2, 0] "
           "ys: [0, 0, 4, 4] } } } } "
           "objects { id: 3 label: 'exploration goal' shape { polygon { outer { "
           "xs: [1, 1.1, 1.1, 1] ys: [1, 1, 1.1, 1.1] } } } } "
           "objects { id: 4 label: 'unreachable place' shape { point { x: 1.5 y: 1 } } } "
           "objects { id: 5 label: 'note' shape { polygon { outer { xs: [1.8, 2, 2] "
           "ys: [0.2, 0.2, 0.4] } } } }"));
  ScriptedServer server(script);
  Put(folder_ / "paths.geojson",
      R"({"type": "FeatureCollection", "features": [{"type": "Feature",
          "properties": {"robot": "r1"}, "geometry": {"type": "LineString",
          "coordinates": [[0.5, 0.5], [0.5, 3.5]]}}]})");
  const Outcome outcome = Render(server, {"--json", "--path", folder_ / "paths.geojson"});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out)["objects"], 2) << "a chair and a note";
  const Pixels pixels(Get(path_));
  const auto at = [&pixels](double x, double y) {
    return pixels.At(static_cast<int>(kMargin + 400 * x),
                     static_cast<int>(kMargin + 400 * (4 - y)));
  };
  EXPECT_EQ(at(1.2, 1.4), 0xFFFFFFu) << "the area is not filled";
  EXPECT_EQ(at(1.5, 1.0), 0xD90000u) << "a place that can't be reached";
  EXPECT_EQ(at(1.05, 1.05), 0x191919u) << "the goal of a robot that is not known";
  EXPECT_EQ(at(0.5, 2.0), 0x0073B3u) << "the path";
}

TEST_F(RenderTest, AnAreaDrawnFarAroundTheMapDoesNotMakeItSmall) {
  Script script = Site();
  script.parts.insert(
      script.parts.begin(),
      Part("layer: 'explorations' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE "
           "objects { id: 2 label: 'exploration' shape { polygon { outer { xs: [-99, 99, 99, -99] "
           "ys: [-99, -99, 99, 99] } } } }"));
  ScriptedServer server(script);
  const Outcome outcome = Render(server, {});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  // (0, 0) to (2, 4) with 5 % of 4 m around, 1600 pixels high.
  const Pixels pixels(Get(path_));
  const auto at = [&pixels](double x, double y) {
    return pixels.At(static_cast<int>(kMargin + 1600 / 4.4 * (x + 0.2)),
                     static_cast<int>(kMargin + 1600 / 4.4 * (4.2 - y)));
  };
  for (const double y : {2.2, 3.0, 3.8}) EXPECT_EQ(at(1.5, y), at(1.2, 3.0)) << "the chair";
  EXPECT_NE(at(1.5, 3.0), at(0.5, 3.0));
}

TEST_F(RenderTest, AMapOfLinesAndPointsHasRoomAroundThem) {
  Script script;
  script.parts = {
      Part("layer: 'lanes' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE "
           "objects { id: 1 label: 'lane' existence: 1 shape { line_string { xs: [0, 3] "
           "ys: [0, 0] } } } "
           "objects { id: 2 label: 'dock' existence: 1 shape { point { x: 1 y: 0 } } }")};
  ScriptedServer server(script);
  const Outcome outcome = Render(server, {"--json"});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out)["objects"], 2);
  // (-0.5, -0.5) to (3.5, 0.5), 1600 pixels wide.
  const Pixels pixels(Get(path_));
  const auto at = [&pixels](double x, double y) {
    return pixels.At(static_cast<int>(kMargin + 400 * (x + 0.5)),
                     static_cast<int>(kMargin + 400 * (0.5 - y)));
  };
  EXPECT_EQ(at(2.0, 0.0), RgbOf(ColourOfLabel("lane")));
  EXPECT_EQ(at(1.0, 0.0), RgbOf(ColourOfLabel("dock"))) << "points lie on lines";
  EXPECT_EQ(at(2.0, 0.2), 0xFFFFFFu);
}

TEST_F(RenderTest, AnExplorationThatIsNoAreaIsDrawnAsAnObject) {
  Script script = Site();
  script.parts.insert(
      script.parts.begin(),
      Part("layer: 'explorations' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE "
           "objects { id: 2 label: 'exploration' existence: 1 shape { point { x: 0.5 y: 3 } } }"));
  ScriptedServer server(script);
  const Outcome outcome = Render(server, {"--json"});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out)["objects"], 2);
}

TEST_F(RenderTest, PathsThatAreNoneAreErrorsThatAskNothing) {
  ScriptedServer server(Site());
  Put(folder_ / "paths.json", "[]");
  const Outcome outcome = Render(server, {"--path", folder_ / "paths.json"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_EQ(outcome.err, "hypermap: INVALID_ARGUMENT: " + (folder_ / "paths.json") +
                             ": not a GeoJSON FeatureCollection\n");
  EXPECT_THAT(Render(server, {"--path", folder_ / "none.json"}).err, HasSubstr("NOT_FOUND"));
  EXPECT_THAT(server.Requests(), IsEmpty());
  EXPECT_THAT(folder_.Names(), ElementsAre("paths.json"));
}

TEST_F(RenderTest, NothingToDrawIsAnError) {
  Script script = Site();
  script.parts[1].mutable_cells()->set_values(0, std::nan(""));
  script.parts[2].clear_objects();
  ScriptedServer server(script);
  Outcome outcome = Render(server, {});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, HasSubstr("map \"office\" has nothing to draw\n"));
  EXPECT_THAT(Render(server, {"--area", "0,0", "1,0", "1,1"}).err, HasSubstr("in the area\n"));
  EXPECT_THAT(folder_.Names(), IsEmpty());
}

TEST_F(RenderTest, ErrorsLeaveNoFile) {
  ScriptedServer server(Site());
  EXPECT_THAT(
      Render(server, {"--pixels_per_m", "2001"}).err,
      HasSubstr("the image would have 4002 x 8004 pixels, but may have at most 8000 a side"));
  EXPECT_THAT(Render(server, {"--area", "0,0", "1,1"}).err, HasSubstr("INVALID_ARGUMENT"));
  Script script;
  script.status = grpc::Status(grpc::StatusCode::NOT_FOUND, "map \"office\" does not exist");
  ScriptedServer empty(script);
  EXPECT_EQ(Render(empty, {}).err, "hypermap: NOT_FOUND: map \"office\" does not exist\n");
  EXPECT_THAT(folder_.Names(), IsEmpty());
  const Outcome outcome = RunOn(server, {"render", "office", "-o", folder_ / "none/map.png"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, HasSubstr("none/map.png\""));
  EXPECT_THAT(folder_.Names(), IsEmpty());
}

TEST_F(RenderTest, WrongUsageAsksNothing) {
  ScriptedServer server(Site());
  EXPECT_EQ(RunOn(server, {"render", "office"}).exit_code, kExitUsage);
  for (const Args& args : {Args{"--pixels_per_m", "0"},
                           {"--pixels_per_m", "nan"},
                           {"--area", "1,2,3"},
                           {"--at", "yesterday"}}) {
    EXPECT_EQ(Render(server, args).exit_code, kExitUsage) << args[0] << ' ' << args[1];
  }
  EXPECT_THAT(server.Requests(), IsEmpty());
}

}  // namespace
}  // namespace hypermap::cli
