// Tests of the explore commands: requests, output and errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

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

template <typename Message>
Message Parse(const std::string& text) {
  Message message;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &message)) << text;
  return message;
}

constexpr char kActive[] =
    "exploration { id: 7 state: EXPLORATION_STATE_ACTIVE "
    "area { outer { xs: [0, 3, 3] ys: [0, 0, 2] } } occupancy_layer: 'floor' "
    "exploration_layer: 'seen' robot_radius_m: 0.25 range_m: 4 min_gain_cells: 4 "
    "start_time { seconds: 10 } "
    "goals { id: 9 robot: 'r1' position { x: 1.025 y: 0.5 } gain_cells: 40 path_length_m: 2.516 "
    "expire_time { seconds: 70 } } "
    "unreachable_places { id: 8 robot: 'r2' position { x: 2 y: -1 } } }";
constexpr char kEnded[] =
    "exploration { id: 4 state: EXPLORATION_STATE_ENDED "
    "end_reason: END_REASON_ONLY_UNREACHABLE_LEFT "
    "area { outer { xs: [0, 3, 3] ys: [0, 0, 2] } } occupancy_layer: 'floor' "
    "exploration_layer: 'seen' start_time { } end_time { seconds: 5 } }";

// One active exploration and one that has ended.
Script Explorations() {
  const std::string active = kActive, ended = kEnded;
  Script script;
  script.started = Parse<v1::StartExplorationResponse>("revision: 12 " + active);
  script.exploration = Parse<v1::GetExplorationResponse>(
      "revision: 13 progress { explored_cells: 600 reachable_cells: 200 unreachable_cells: 200 "
      "fraction: 0.75 rate_m2_per_s: 0.125 cell_area_m2: 0.01 } " +
      active);
  script.explorations = Parse<v1::ListExplorationsResponse>(
      "revision: 13 frame_id: 'map' explorations " + active.substr(sizeof("exploration")) +
      " explorations " + ended.substr(sizeof("exploration")));
  script.frontiers = Parse<v1::ListFrontiersResponse>(
      "revision: 13 frame_id: 'map' exploration_id: 7 "
      "frontiers { num_cells: 2 centroid { x: 1 } viewpoint { y: 2 } gain_cells: 30 } "
      "frontiers { num_cells: 1 centroid { y: 7 } }");
  script.stopped = Parse<v1::StopExplorationResponse>(ended);
  return script;
}

TEST(ExploreTest, CommandLinesBecomeRequests) {
  const std::string triangle = "area { outer { xs: -1 xs: 2 xs: 2 ys: -1 ys: -1 ys: 3 } } ";
  const struct {
    Args args;
    std::string request;
  } lines[] = {
      {{"start", "office", "--occupancy", "floor", "--area", "-1,-1", "2,-1", "2,3"},
       R"(StartExploration map: "office" )" + triangle +
           R"(occupancy_layer: "floor" exploration_layer: "explored" )"
           R"(explored_rule: CELL_RULE_CENTRE robot_radius_m: 0.25 range_m: 4 min_gain_cells: 4)"},
      {{"start",   "office",  "--occupancy", "floor",   "--area", "-1,-1",          "2,-1",
        "2,3",     "--layer", "seen",        "--frame", "dock",   "--robot_radius", "0.5",
        "--range", "3",       "--min_gain",  "9",       "--rule", "touched"},
       R"(StartExploration map: "office" )" + triangle +
           R"(frame_id: "dock" occupancy_layer: "floor" exploration_layer: "seen" )"
           R"(explored_rule: CELL_RULE_TOUCHED robot_radius_m: 0.5 range_m: 3 min_gain_cells: 9)"},
      {{"status", "office"}, R"(GetExploration map: "office")"},
      {{"status", "office", "7", "--frame", "dock"},
       R"(GetExploration map: "office" exploration_id: 7 frame_id: "dock")"},
      {{"list", "office"}, R"(ListExplorations map: "office")"},
      {{"frontiers", "office"}, R"(ListFrontiers map: "office")"},
      {{"frontiers", "office", "7", "--cells"},
       R"(ListFrontiers map: "office" exploration_id: 7 with_cells: true)"},
      {{"stop", "office", "7"}, R"(StopExploration map: "office" exploration_id: 7)"},
  };
  for (const auto& line : lines) {
    ScriptedServer server(Explorations());
    Args args = line.args;
    args.insert(args.begin(), "explore");
    const Outcome outcome = RunOn(server, args);
    EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
    EXPECT_THAT(server.Requests(), ElementsAre(line.request));
  }
}

TEST(ExploreTest, WrongUsageAsksNothing) {
  ScriptedServer server(Explorations());
  const Args lines[] = {
      {"explore"},
      {"explore", "status"},
      {"explore", "status", "office", "x"},
      {"explore", "status", "office", "0"},
      {"explore", "start", "office", "--occupancy", "floor"},
      {"explore", "start", "office", "--area", "0,0", "1,0", "1,1"},
      {"explore", "start", "office", "--occupancy", "floor", "--area", "0,0", "1,0", "1"},
      {"explore", "start", "office", "--occupancy", "floor", "--area", "0,0", "1,0", "1,1",
       "--rule", "half"},
      {"explore", "start", "office", "--occupancy", "floor", "--area", "0,0", "1,0", "1,1",
       "--range", "far"},
  };
  for (const Args& args : lines) {
    EXPECT_EQ(RunOn(server, args).exit_code, kExitUsage) << ::testing::PrintToString(args);
  }
  EXPECT_THAT(server.Requests(), IsEmpty());
}

TEST(ExploreTest, ErrorsAreTheServersOwn) {
  Script script;
  script.status = grpc::Status(grpc::StatusCode::NOT_FOUND, "no exploration 7");
  ScriptedServer server(script);
  for (const char* command : {"status", "frontiers", "stop"}) {
    const Outcome outcome = RunOn(server, {"explore", command, "office", "7"});
    EXPECT_EQ(outcome.exit_code, kExitError);
    EXPECT_EQ(outcome.err, "hypermap: NOT_FOUND: no exploration 7\n");
    EXPECT_EQ(outcome.out, "");
  }
}

TEST(ExploreTest, StatusIsTablesOfFloorGoalsAndPlaces) {
  ScriptedServer server(Explorations());
  EXPECT_EQ(RunOn(server, {"explore", "status", "office"}).out,
            "FLOOR                    CELLS  AREA [m²]  SHARE [%]\n"
            "explored                   600          6         60\n"
            "unexplored, reachable      200          2         20\n"
            "unexplored, unreachable    200          2         20\n"
            "\n"
            "GOAL  ROBOT  X [m]  Y [m]  GAIN [cells]  WAY [m]  LEASED UNTIL\n"
            "   9  r1     1.025    0.5            40     2.52  1970-01-01 00:01:10.000Z\n"
            "\n"
            "UNREACHABLE  FOR ROBOT  X [m]  Y [m]\n"
            "          8  r2             2     -1\n"
            "exploration 7 of floor into seen: active, 75 % seen, 0.125 m²/s, revision 13\n");
}

TEST(ExploreTest, StatusForPrograms) {
  ScriptedServer server(Explorations());
  EXPECT_EQ(json::parse(RunOn(server, {"--json", "explore", "status", "office"}).out),
            json::parse(R"({"map": "office", "revision": 13, "exploration": {
                "id": 7, "state": "active", "end_reason": "",
                "area": [[[0, 0], [3, 0], [3, 2], [0, 0]]],
                "occupancy_layer": "floor", "exploration_layer": "seen",
                "robot_radius_m": 0.25, "range_m": 4, "min_gain_cells": 4,
                "started": "1970-01-01T00:00:10+00:00",
                "goals": [{"id": 9, "robot": "r1", "position": [1.025, 0.5], "gain_cells": 40,
                           "path_length_m": 2.516, "expires_at": "1970-01-01T00:01:10+00:00"}],
                "unreachable_places": [{"id": 8, "robot": "r2", "position": [2, -1]}]},
              "progress": {"explored_cells": 600, "reachable_cells": 200,
                           "unreachable_cells": 200, "fraction": 0.75, "rate_m2_per_s": 0.125,
                           "cell_area_m2": 0.01}})"));
}

TEST(ExploreTest, StartAndStopShowTheExploration) {
  ScriptedServer server(Explorations());
  const Args start{"explore", "start", "office", "--occupancy", "floor",
                   "--area",  "0,0",   "3,0",    "3,2"};
  EXPECT_THAT(RunOn(server, start).out,
              HasSubstr("\nexploration 7 of floor into seen: active, revision 12\n"));
  EXPECT_EQ(RunOn(server, {"explore", "stop", "office"}).out,
            "exploration 4 of floor into seen: ended: only unreachable left\n");
  const json stopped = json::parse(RunOn(server, {"--json", "explore", "stop", "office"}).out);
  EXPECT_EQ(stopped["exploration"]["state"], "ended");
  EXPECT_EQ(stopped["exploration"]["end_reason"], "only_unreachable_left");
  EXPECT_EQ(stopped["exploration"]["ended"], "1970-01-01T00:00:05+00:00");
  EXPECT_FALSE(stopped.contains("progress"));
}

TEST(ExploreTest, AnAreaThatIsNoPolygonIsAnErrorOfTheCommand) {
  ScriptedServer server(Explorations());
  const Outcome outcome =
      RunOn(server, {"explore", "start", "office", "--occupancy", "floor", "--area", "0,0", "3,0"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, HasSubstr("INVALID_ARGUMENT: "));
  EXPECT_THAT(server.Requests(), IsEmpty());
}

TEST(ExploreTest, AListHasARowEach) {
  ScriptedServer server(Explorations());
  EXPECT_EQ(RunOn(server, {"explore", "list", "office"}).out,
            "ID  STATE                         OCCUPANCY  EXPLORED  AREA [m²]  GOALS  UNREACHABLE  "
            "STARTED                   ENDED\n"
            " 7  active                        floor      seen              3      1            1  "
            "1970-01-01 00:00:10.000Z\n"
            " 4  ended: only unreachable left  floor      seen              3      0            0  "
            "1970-01-01 00:00:00.000Z  1970-01-01 00:00:05.000Z\n"
            "2 explorations, revision 13\n");
  const json list = json::parse(RunOn(server, {"--json", "explore", "list", "office"}).out);
  EXPECT_EQ(list["frame_id"], "map");
  EXPECT_EQ(list["explorations"][0]["id"], 7);
  EXPECT_EQ(list["explorations"][1]["id"], 4);
}

TEST(ExploreTest, FrontiersTellFromWhereTheyAreSeen) {
  Script script = Explorations();
  ScriptedServer server(script);
  EXPECT_EQ(RunOn(server, {"explore", "frontiers", "office"}).out,
            "FRONTIER  CELLS  X [m]  Y [m]  SEEN FROM  GAIN [cells]\n"
            "       1      2      1      0  (0, 2)               30\n"
            "       2      1      0      7  nowhere               0\n"
            "2 frontiers of exploration 7, revision 13\n");
  EXPECT_EQ(json::parse(RunOn(server, {"--json", "explore", "frontiers", "office"}).out),
            json::parse(R"({"map": "office", "revision": 13, "frame_id": "map",
                "exploration_id": 7, "frontiers": [
                {"num_cells": 2, "centroid": [1, 0], "viewpoint": [0, 2], "gain_cells": 30},
                {"num_cells": 1, "centroid": [0, 7], "viewpoint": null, "gain_cells": 0}]})"));

  v1::Point* cell = script.frontiers.mutable_frontiers(1)->add_cells();
  cell->set_x(0.25);
  cell->set_y(7);
  ScriptedServer with_cells(script);
  EXPECT_THAT(RunOn(with_cells, {"explore", "frontiers", "office", "--cells"}).out,
              HasSubstr("\n\nFRONTIER  CELL X [m]  Y [m]\n"
                        "       2        0.25      7\n"));
  const json shown =
      json::parse(RunOn(with_cells, {"--json", "explore", "frontiers", "office", "--cells"}).out);
  EXPECT_EQ(shown["frontiers"][1]["cells"], (json{{0.25, 7}}));
}

TEST(ExploreTest, AnExplorationLayerMayBeMadeWithARule) {
  ScriptedServer server({});
  const Args create{"layer",  "create",      "office",       "seen",
                    "--kind", "exploration", "--resolution", "1"};
  Args touched = create, half = create;
  touched.insert(touched.end(), {"--explored_rule", "touched"});
  half.insert(half.end(), {"--explored_rule", "half"});
  EXPECT_EQ(RunOn(server, touched).exit_code, kExitOk);
  EXPECT_EQ(RunOn(server, half).exit_code, kExitUsage);
  EXPECT_THAT(server.Requests(),
              ElementsAre(R"(CreateLayer map: "office" layer { name: "seen" )"
                          R"(kind: LAYER_KIND_EXPLORATION grid { origin { } resolution_m: 1 } )"
                          R"(explored_rule: CELL_RULE_TOUCHED })"));
}

TEST(ExploreTest, ARuleIsOfExplorationLayersOnly) {
  ScriptedServer server({});
  const Outcome outcome = RunOn(server, {"layer", "create", "office", "floor", "--kind",
                                         "occupancy", "--explored_rule", "touched"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, HasSubstr("--explored_rule is for exploration layers only"));
  EXPECT_THAT(server.Requests(), IsEmpty());
}

}  // namespace
}  // namespace hypermap::cli
