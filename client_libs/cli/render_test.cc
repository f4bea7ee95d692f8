// The command render: what it asks, what it writes, how it fails.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "client_libs/cli/canvas.h"
#include "client_libs/cli/image_testing.h"
#include "client_libs/cli/run_testing.h"
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

// Two free cells of a metre and an unknown one at their right, and a chair above the cells.
Script Site() {
  Script script;
  script.revision = 7;
  script.parts = {
      Part("layer: 'adrift' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_NO_TRANSFORM"),
      Part("layer: 'floor' kind: LAYER_KIND_OCCUPANCY status: ANSWER_STATUS_VALUE "
           "cells { grid { origin { } resolution_m: 1 } rows: [0, 0] col_begins: [0, 2] "
           "col_ends: [2, 9] values: [0, nan] }"),
      Part("layer: 'things' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE "
           "objects { id: 1 label: 'chair' existence: 0.9 polygon { outer { "
           "points { x: 1 y: 2 } points { x: 2 y: 2 } points { x: 2 y: 4 } points { x: 1 y: 4 } "
           "} } }")};
  return script;
}

class RenderTest : public ::testing::Test {
 protected:
  Outcome Render(const ScriptedServer& server, Args args) {
    args.insert(args.begin(), {"render", "office", "-o", path_});
    return RunOn(server, args);
  }

  TemporaryDirectory folder_;
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
  // (0, 0) to (2, 4), 1600 pixels high.
  const auto at = [&pixels](double x, double y) {
    return pixels.At(static_cast<int>(kMargin + 400 * x),
                     static_cast<int>(kMargin + 400 * (4 - y)));
  };
  EXPECT_EQ(at(1.5, 0.5), 0xF8F8F8u);
  EXPECT_EQ(at(0.5, 3.0), 0xFFFFFFu);
  EXPECT_NE(at(1.5, 3.0), 0xFFFFFFu);
  EXPECT_THAT(server.Requests(),
              ElementsAre(StartsWith("QueryArea map: \"office\" area"),
                          AllOf(StartsWith("QueryArea map: \"office\" layers: \"floor\" area"),
                                HasSubstr("at_revision: 7"))));
}

TEST_F(RenderTest, AsksForTheLayersTheAreaAndTheRevisionThatAreWanted) {
  ScriptedServer server(Site());
  const Outcome outcome = Render(server, {"--layers", "floor,things", "--area", "0,0", "3,0", "3,1",
                                          "--pixels_per_m", "100", "--at", "5"});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(server.Requests().front(),
              AllOf(StartsWith("QueryArea map: \"office\" layers: \"floor\" layers: \"things\""),
                    HasSubstr("points { x: 3 y: 1 }"), HasSubstr("at_revision: 5")));
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
  EXPECT_THAT(Render(server, {"--pixels_per_m", "2001"}).err,
              HasSubstr("the plan would have 4002 x 8004 pixels, and may have 8000 a side"));
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
