// Tests of whole command lines: requests, output and exit codes.
#include "client_libs/cli/run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>

#include "client_libs/cli/testing/run.h"
#include "client_libs/testing/scripted_server.h"
#include "google/protobuf/text_format.h"

namespace hypermap::cli {
namespace {

using client::Script;
using client::ScriptedServer;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

struct CommandLine {
  Args args;
  std::string request;
};

TEST(RunTest, CommandLinesBecomeRequests) {
  const std::string triangle = "area { outer { xs: -1 xs: 2 xs: 2 ys: -1 ys: -1 ys: 3 } }";
  const CommandLine lines[] = {
      {{"servers"}, "ListServers"},
      {{"server", "drain", "a", "--undo"}, R"(DrainServer server: "a" undo: true)"},
      {{"whoami"}, "GetCaller"},
      {{"maps"}, "ListMaps"},
      {{"map", "create", "office", "--frame", "site"},
       R"(CreateMap map: "office" frame_id: "site")"},
      {{"map", "delete", "office", "--yes"}, R"(DeleteMap map: "office")"},
      {{"layers", "office"}, R"(ListLayers map: "office")"},
      {{"transforms", "office"}, R"(ListTransforms map: "office")"},
      {{"transform", "set", "office", "dock", "map", "-20", "-.5", "-1.75"},
       R"(SetTransform map: "office" transform { parent_frame_id: "map" child_frame_id: "dock" )"
       R"(parent_from_child { x: -20 y: -0.5 yaw: -1.75 } })"},
      {{"layer", "create", "office", "floor", "--kind", "occupancy", "--resolution", "0.05",
        "--origin", "-1,-2.5,0.5", "--frame", "site", "--occupied-above", "0.7"},
       R"(CreateLayer map: "office" layer { name: "floor" kind: LAYER_KIND_OCCUPANCY )"
       R"(frame_id: "site" grid { origin { x: -1 y: -2.5 yaw: 0.5 } resolution_m: 0.05 } )"
       R"(thresholds { free_below: 0.196 occupied_above: 0.7 } })"},
      {{"layer", "create", "office", "wifi", "--kind", "scalar", "--resolution", "1", "--unit",
        "dBm"},
       R"(CreateLayer map: "office" layer { name: "wifi" kind: LAYER_KIND_SCALAR )"
       R"(grid { origin { } resolution_m: 1 } unit: "dBm" })"},
      {{"layer", "create", "office", "things", "--kind", "semantic"},
       R"(CreateLayer map: "office" layer { name: "things" kind: LAYER_KIND_SEMANTIC })"},
      {{"layer", "create", "office", "lanes", "--kind", "semantic", "--shapes",
        "point,line_string"},
       R"(CreateLayer map: "office" layer { name: "lanes" kind: LAYER_KIND_SEMANTIC )"
       R"(shape_kinds: SHAPE_KIND_LINE_STRING shape_kinds: SHAPE_KIND_POINT })"},
      {{"alias", "office", "things", "tv=tvmonitor", "Furniture=chair, couch", "sofa="},
       R"(ApplyEdits map: "office" edits { set_aliases { layer: "things" )"
       R"(aliases { alias: "Furniture" labels: " couch" labels: "chair" } aliases { alias: "sofa" } )"
       R"(aliases { alias: "tv" labels: "tvmonitor" } } })"},
      {{"layer", "delete", "office", "floor"}, R"(DeleteLayer map: "office" layer: "floor")"},
      {{"query", "point", "office", "-2.75", "-0.4"},
       R"(QueryPoint scope { map: "office" } point { x: -2.75 y: -0.4 })"},
      {{"query", "point", "office", "-.5", "-1e-3"},
       R"(QueryPoint scope { map: "office" } point { x: -0.5 y: -0.001 })"},
      {{"query", "point", "--layer", "b", "--layer", "a", "office", "1", "2", "--frame", "dock"},
       R"(QueryPoint scope { map: "office" layers: "b" layers: "a" frame_id: "dock" } point { x: 1 y: 2 })"},
      {{"query", "point", "office", "1", "2", "--tolerance", "0.25"},
       R"(QueryPoint scope { map: "office" } point { x: 1 y: 2 } tolerance_m: 0.25)"},
      {{"query", "point", "point", "0.1", "2.7500000000000004"},
       R"(QueryPoint scope { map: "point" } point { x: 0.1 y: 2.7500000000000004 })"},
      {{"query", "area", "office", "-1,-1", "2,-1", "2,3"},
       R"(QueryArea scope { map: "office" } )" + triangle},
      {{"query", "area", "office", "-1,-1", "2,-1", "2,3", "--layer", "floor", "--json"},
       R"(QueryArea scope { map: "office" layers: "floor" } )" + triangle},
      {{"query", "value", "office", "dining table"},
       R"(QueryValue scope { map: "office" } value: "dining table")"},
      {{"query", "value", "office", "-70..-50", "--area", "-1,-1", "2,-1", "2,3"},
       R"(QueryValue scope { map: "office" } value: "-70..-50" )" + triangle},
      {{"query", "value", "maps", ">0.65", "--area", "-1,-1", "2,-1", "2,3", "--layer", "floor"},
       R"(QueryValue scope { map: "maps" layers: "floor" } value: ">0.65" )" + triangle},
      {{"query", "nearest", "office", "-1", "-2", "--value", "chair", "-k", "3"},
       R"(QueryNearest scope { map: "office" } point { x: -1 y: -2 } value: "chair" k: 3)"},
      {{"query", "area", "office", "-1,-1", "2,-1", "2,3", "--at", "12"},
       R"(QueryArea scope { map: "office" } as_of { at_revision: 12 } )" + triangle},
      {{"query", "point", "office", "1", "2", "--at", "1970-01-01T01:00:01+01:00"},
       R"(QueryPoint scope { map: "office" } as_of { at_time { seconds: 1 } } point { x: 1 y: 2 })"},
      {{"query", "value", "office", "chair", "--linearizable"},
       R"(QueryValue scope { map: "office" } as_of { consistency: CONSISTENCY_LINEARIZABLE } value: "chair")"},
      {{"query", "value", "office", "chair", "--min_revision", "9"},
       R"(QueryValue scope { map: "office" } as_of { min_revision: 9 } value: "chair")"},
      {{"watch", "office"}, R"(Watch scope { map: "office" } coalesce: true)"},
      {{"watch", "office", "--layer", "a", "--layer", "b", "--frame", "dock", "--class", "cup",
        "--from", "0", "--area", "-1,-1", "2,-1", "2,3"},
       R"(Watch scope { map: "office" layers: "a" layers: "b" frame_id: "dock" } )" + triangle +
           R"( classes: "cup" start_revision: 0 coalesce: true)"},
      {{"watch", "office", "--from", "4", "--incarnation", "18446744073709551615"},
       R"(Watch scope { map: "office" incarnation: 18446744073709551615 } start_revision: 4 )"
       R"(coalesce: true)"},
      {{"log", "office", "--limit", "7"},
       R"(ListRevisions map: "office" page_size: 7 newest_first: true)"},
      {{"query", "nearest", "office", "1", "2", "--value=<-70"},
       R"(QueryNearest scope { map: "office" } point { x: 1 y: 2 } value: "<-70" k: 1)"},
  };
  for (const CommandLine& line : lines) {
    // The error ends a watch, which would otherwise stay open.
    Script script;
    script.watches = {{{}, false, grpc::Status(grpc::StatusCode::NOT_FOUND, "no map")}};
    ScriptedServer server(script);
    const Outcome outcome = RunOn(server, line.args);
    EXPECT_EQ(outcome.exit_code, line.args[0] == "watch" ? kExitError : kExitOk) << outcome.err;
    EXPECT_THAT(server.Requests(), ElementsAre(line.request));
  }
}

TEST(RunTest, WrongUsageIsOneLineAndExitCode2) {
  const Args lines[] = {
      {},
      {"fly"},
      {"query"},
      {"query", "point", "office", "1"},
      {"query", "point", "office", "1", "x"},
      {"query", "point", "office", "nan", "1"},
      {"query", "point", "office", "1", "2", "3"},
      {"query", "point", "office", "1", "2", "--tolerance", "-1"},
      {"query", "points", "office", "--stdin", "--tolerance", "inf"},
      {"query", "area", "office"},
      {"query", "area", "office", "1,2", "3,4", "5"},
      {"query", "value", "office"},
      {"query", "nearest", "office", "1", "2"},
      {"query", "nearest", "office", "1", "2", "--value", "chair", "-k", "many"},
      {"layer", "create", "office", "floor"},
      {"layer", "create", "office", "floor", "--kind", "raster"},
      {"layer", "create", "office", "lanes", "--kind", "semantic", "--shapes", "line"},
      {"layer", "create", "office", "floor", "--kind", "scalar", "--origin", "0,0,0"},
      {"layer", "create", "office", "f", "--kind", "scalar", "--resolution", "1", "--origin", "0"},
      {"alias", "office", "things"},
      {"alias", "office", "things", "tv"},
      {"alias", "office", "things", "=tvmonitor"},
      {"eval", "office", "--layer", "things"},
      {"eval", "office", "--truth", "gt.geojson"},
      {"eval", "office", "--layer", "things", "--truth", "gt.geojson", "--truth-map", "gt"},
      {"transform", "set", "office", "dock", "map", "1", "2"},
      {"query", "point", "office", "1", "2", "--at", "yesterday"},
      {"query", "point", "office", "1", "2", "--min_revision", "-1"},
      {"watch"},
      {"watch", "office", "--from", "-1"},
      {"watch", "office", "--count", "0"},
      {"watch", "office", "--area", "1,2", "x"},
      {"changes", "office"},
      {"changes", "office", "--from", "x"},
      {"log", "office", "--limit", "0"},
      {"edit", "office", "changes.geojson", "--layer", "things", "--ttl", "soon"},
      {"import", "office.hmap"},
      {"import", "office.txt", "--map", "office"},
      {"import", "office.gpkg", "--map", "office"},
      {"import", "office.mcap", "--map", "office"},
      {"import", "office.hmap", "--map", "office", "--format", "pdf"},
      {"edit", "office", "changes.geojson"},
      {"export", "office", "--format", "hmap"},
      {"export", "office", "-o", "office.txt"},
      {"export", "office", "-o", "office.gpkg", "--layer", "floor"},
      {"export", "office", "-o", "office.yaml", "--image", "jpg"},
      {"export", "office", "-o", "office.hmap", "--from", "1"},
      {"export", "office", "-o", "office.mcap", "--from", "-1"},
      {"backup", "office"},
      {"maps", "--timeout", "soon"},
      {"maps", "--timeout", "-1s"},
      {"maps", "--colour"},
  };
  for (const Args& args : lines) {
    const Outcome outcome = RunCommand(args);
    EXPECT_EQ(outcome.exit_code, kExitUsage) << ::testing::PrintToString(args);
    EXPECT_EQ(outcome.out, "");
    EXPECT_THAT(outcome.err, StartsWith("hypermap: "));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

TEST(RunTest, HelpAndVersionAreNoErrors) {
  const Args lines[] = {{"--help"}, {"query", "--help"}, {"query", "area", "-h"}, {"--version"}};
  for (const Args& args : lines) {
    const Outcome outcome = RunCommand(args);
    EXPECT_EQ(outcome.exit_code, kExitOk);
    EXPECT_NE(outcome.out, "");
    EXPECT_EQ(outcome.err, "");
  }
}

TEST(RunTest, AServersErrorIsOneLineAndExitCode1) {
  Script script;
  script.status = grpc::Status(grpc::StatusCode::NOT_FOUND, "map \"x\"\ndoes not exist");
  ScriptedServer server(script);
  const Args lines[] = {{"layers", "x"},
                        {"query", "point", "x", "0", "0"},
                        {"--json", "query", "area", "x", "0,0", "1,0", "1,1"}};
  for (const Args& args : lines) {
    const Outcome outcome = RunOn(server, args);
    EXPECT_EQ(outcome.exit_code, kExitError);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(outcome.err, "hypermap: NOT_FOUND: map \"x\" does not exist\n");
  }
}

TEST(RunTest, KindsOfShapeAreForLayersOfObjects) {
  ScriptedServer server({});
  const Outcome outcome = RunOn(server, {"layer", "create", "office", "floor", "--kind",
                                         "occupancy", "--resolution", "1", "--shapes", "point"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_EQ(outcome.err, "hypermap: INVALID_ARGUMENT: --shapes is for layers of objects only\n");
  EXPECT_THAT(server.Requests(), IsEmpty());
}

TEST(RunTest, APolygonThatIsNoneIsAnErrorOfTheCommand) {
  ScriptedServer server({});
  const Outcome outcome = RunOn(server, {"query", "area", "office", "0,0", "1,1"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, StartsWith("hypermap: INVALID_ARGUMENT: "));
}

TEST(RunTest, AServerThatIsNotThereIsNamed) {
  std::string address;
  { address = ScriptedServer({}).address(); }
  const Outcome outcome = RunCommand({"--server", address, "maps"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, StartsWith("hypermap: UNAVAILABLE: server " + address));
}

TEST(RunTest, TheServerMayComeFromTheEnvironment) {
  ScriptedServer server({});
  setenv("HYPERMAP_SERVER", server.address().c_str(), 1);
  const Outcome outcome = RunCommand({"--json", "maps"});
  unsetenv("HYPERMAP_SERVER");
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(outcome.out, "{\"maps\":[]}\n");
}

TEST(RunTest, TheTimeoutEndsACommand) {
  Script script;
  script.endless = true;
  ScriptedServer server(script);
  const Outcome outcome =
      RunOn(server, {"--timeout", "50ms", "query", "area", "office", "0,0", "1,0", "1,1"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, StartsWith("hypermap: DEADLINE_EXCEEDED: "));
}

TEST(RunTest, AnAnswerThatBreaksOffHasNoEnd) {
  Script script;
  script.parts.resize(1);
  ASSERT_TRUE(google::protobuf::TextFormat::ParseFromString(
      "layer: 'wifi' kind: LAYER_KIND_SCALAR status: ANSWER_STATUS_NO_TRANSFORM",
      &script.parts[0]));
  script.status = grpc::Status(grpc::StatusCode::ABORTED, "shutting down");
  ScriptedServer server(script);
  const Outcome outcome = RunOn(server, {"--json", "query", "value", "office", "free"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_EQ(outcome.out, "{\"layer\":\"wifi\",\"status\":\"no_transform\"}\n");
}

TEST(RunTest, AnAnswerThatCannotBeWrittenIsAnError) {
  ScriptedServer server({});
  std::ostringstream out, err;
  out.setstate(std::ios::badbit);
  std::istringstream in;
  EXPECT_EQ(cli::Run({"--server", server.address(), "maps"}, in, out, err), kExitError);
  EXPECT_THAT(err.str(), HasSubstr("could not be written"));
}

TEST(ImportCommandTest, TheExtensionTellsTheFormat) {
  testing::TemporaryFolder directory;
  const std::pair<std::string, std::string> formats[] = {{"a.hmap", "FILE_FORMAT_HMAP"},
                                                         {"a.geojson", "FILE_FORMAT_GEOJSON"},
                                                         {"a.JSON", "FILE_FORMAT_GEOJSON"}};
  for (const auto& [name, format] : formats) {
    Put(directory / name, "data");
    ScriptedServer server({});
    const Outcome outcome =
        RunOn(server, {"import", directory / name, "--map", "office", "--layer", "l"});
    EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
    EXPECT_THAT(server.Requests(), ElementsAre("ImportMap map: \"office\" format: " + format +
                                                   " layer: \"l\" create_map: true",
                                               "file " + name + " (4 bytes)"));
  }
}

TEST(ImportCommandTest, Nav2BringsTheImageThatTheYamlNames) {
  testing::TemporaryFolder directory;
  std::filesystem::create_directory(directory / "images");
  Put(directory / "images/floor.pgm", "P5 1 1 255 x");
  Put(directory / "site.yaml", "image: images/floor.pgm\nresolution: 0.05\n");
  ScriptedServer server({});
  const Outcome outcome = RunOn(
      server, {"import", directory / "site.yaml", "--map", "office", "--frame", "floor_frame"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(server.Requests(),
              ElementsAre("ImportMap map: \"office\" format: FILE_FORMAT_NAV2 frame_id: "
                          "\"floor_frame\" create_map: true",
                          "file site.yaml (41 bytes)", "file floor.pgm (12 bytes)"));
}

TEST(ImportCommandTest, FilesThatAreMissingOrMakeNoSenseAreErrors) {
  testing::TemporaryFolder directory;
  Put(directory / "no_image.yaml", "resolution: 0.05\n");
  Put(directory / "lost_image.yaml", "image: lost.pgm\n");
  Put(directory / "bad.yaml", "image: [\n");
  ScriptedServer server({});
  for (const char* name :
       {"none.hmap", "none.yaml", "no_image.yaml", "lost_image.yaml", "bad.yaml"}) {
    const Outcome outcome = RunOn(server, {"import", directory / name, "--map", "office"});
    EXPECT_EQ(outcome.exit_code, kExitError) << name;
    EXPECT_THAT(outcome.err, StartsWith("hypermap: ")) << name;
  }
  EXPECT_THAT(server.Requests(), IsEmpty());
}

TEST(EditCommandTest, IsAnImportIntoAMapThatExists) {
  testing::TemporaryFolder directory;
  Put(directory / "changes.txt", "{}");
  Script script;
  script.import.set_map("office");
  script.import.set_revision(3);
  script.import.add_layers("objects");
  ScriptedServer server(script);
  const Outcome outcome =
      RunOn(server, {"--json", "edit", "office", directory / "changes.txt", "--layer", "objects"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(server.Requests(),
              ElementsAre("ImportMap map: \"office\" format: FILE_FORMAT_GEOJSON layer: "
                          "\"objects\"",
                          "file changes.txt (2 bytes)"));
  EXPECT_EQ(outcome.out,
            "{\"map\":\"office\",\"revision\":3,\"layers\":[\"objects\"],\"repairs\":[]}\n");
}

Script ExportOf(const std::vector<std::pair<std::string, std::string>>& files) {
  Script script;
  script.export_parts.emplace_back().mutable_header()->set_map("office");
  for (const auto& [name, data] : files) {
    v1::FileChunk* chunk = script.export_parts.emplace_back().mutable_chunk();
    chunk->set_file_name(name);
    chunk->set_data(data);
  }
  return script;
}

TEST(ExportCommandTest, WritesTheFileUnderTheNameAskedFor) {
  testing::TemporaryFolder directory;
  ScriptedServer server(ExportOf({{"office.hmap", "zip"}}));
  Put(directory / "out.hmap", "what was there before");
  const Outcome outcome =
      RunOn(server, {"export", "office", "-o", directory / "out.hmap", "--layer", "a"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(Get(directory / "out.hmap"), "zip");
  EXPECT_THAT(directory.Names(), ElementsAre("out.hmap"));
  EXPECT_THAT(server.Requests(), ElementsAre("ExportMap map: \"office\" format: FILE_FORMAT_HMAP "
                                             "layers: \"a\" image_format: \"pgm\""));
}

TEST(ExportCommandTest, ANav2YamlNamesTheImageBesideIt) {
  testing::TemporaryFolder directory;
  ScriptedServer server(
      ExportOf({{"floor.yaml", "image: floor.png\norigin: [-1.5, 2, 0.25]\nmode: scale\n"},
                {"floor.png", "pixels"}}));
  const Outcome outcome = RunOn(
      server, {"export", "office", "--format", "nav2", "-o", directory / "x.yaml", "--image=png"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(Get(directory / "x.yaml"), "image: x.png\norigin: [-1.5, 2, 0.25]\nmode: scale\n");
  EXPECT_EQ(Get(directory / "x.png"), "pixels");
  EXPECT_THAT(directory.Names(), ElementsAre("x.png", "x.yaml"));
}

TEST(ExportCommandTest, AnErrorLeavesNoFile) {
  testing::TemporaryFolder directory;
  Script script = ExportOf({{"office.hmap", "zip"}});
  script.backup_pieces = {"SQLite"};
  script.status = grpc::Status(grpc::StatusCode::DATA_LOSS, "damaged");
  ScriptedServer server(script);
  EXPECT_EQ(RunOn(server, {"export", "office", "-o", directory / "a.hmap"}).exit_code, kExitError);
  EXPECT_EQ(RunOn(server, {"export", "office", "-o", directory / "a.gpkg"}).exit_code, kExitError);
  EXPECT_EQ(RunOn(server, {"backup", "office", "-o", directory / "b.gpkg"}).exit_code, kExitError);
  EXPECT_THAT(directory.Names(), IsEmpty());
}

TEST(ExportCommandTest, AFolderThatIsNotThereIsAnError) {
  testing::TemporaryFolder directory;
  ScriptedServer server(ExportOf({{"office.hmap", "zip"}}));
  const Outcome outcome = RunOn(server, {"export", "office", "-o", directory / "none/a.hmap"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, HasSubstr("none/a.hmap"));
}

TEST(EditCommandTest, ConditionsMakeItABatchOfEdits) {
  testing::TemporaryFolder directory;
  Put(directory / "cup.geojson",
      R"({"type": "Feature", "id": 7, "properties": {"label": "cup"}, "geometry":
          {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]}})");
  Script script;
  v1::Layer* layer = script.layers.add_layers();
  layer->set_name("things");
  layer->set_kind(v1::LAYER_KIND_SEMANTIC);
  script.edits.set_revision(5);
  ScriptedServer server(script);
  const Outcome outcome = RunOn(server, {"edit", "office", directory / "cup.geojson", "--layer",
                                         "things", "--ttl", "30s", "--if_version", "4", "--json"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(outcome.out,
            "{\"map\":\"office\",\"revision\":5,\"layers\":[\"things\"],\"repairs\":[]}\n");
  EXPECT_THAT(server.Requests().back(),
              StartsWith("ApplyEdits map: \"office\" edits { put_object {"));
  EXPECT_THAT(server.Requests().back(), HasSubstr("if_version: 4 time_to_live { seconds: 30 }"));
}

TEST(EditCommandTest, LineStringsAndPointsAreEditsToo) {
  testing::TemporaryFolder directory;
  Put(directory / "lanes.geojson",
      R"({"type": "FeatureCollection", "features": [
          {"type": "Feature", "properties": {"label": "lane"}, "geometry":
           {"type": "LineString", "coordinates": [[0, 0], [4, 0], [4, 3]]}},
          {"type": "Feature", "properties": {"label": "dock"}, "geometry":
           {"type": "Point", "coordinates": [2.5, 1]}}]})");
  Script script;
  v1::Layer* layer = script.layers.add_layers();
  layer->set_name("lanes");
  layer->set_kind(v1::LAYER_KIND_SEMANTIC);
  script.edits.set_revision(5);
  ScriptedServer server(script);
  const Outcome outcome = RunOn(server, {"edit", "office", directory / "lanes.geojson", "--layer",
                                         "lanes", "--ttl", "30s", "--json"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(server.Requests().back(),
              HasSubstr("shape { line_string { xs: 0 xs: 4 xs: 4 ys: 0 ys: 0 ys: 3 } }"));
  EXPECT_THAT(server.Requests().back(), HasSubstr("shape { point { x: 2.5 y: 1 } }"));
}

TEST(BackupCommandTest, WritesAllPieces) {
  testing::TemporaryFolder directory;
  Script script;
  script.backup_pieces = {"SQLite", " format 3"};
  ScriptedServer server(script);
  const Args lines[] = {{"backup", "office", "-o", directory / "a.gpkg"},
                        {"export", "office", "--format", "gpkg", "-o", directory / "b.gpkg"}};
  for (const Args& args : lines) {
    const Outcome outcome = RunOn(server, args);
    EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
    EXPECT_EQ(Get(args.back()), "SQLite format 3");
  }
  EXPECT_THAT(directory.Names(), ElementsAre("a.gpkg", "b.gpkg"));
}

}  // namespace
}  // namespace hypermap::cli
