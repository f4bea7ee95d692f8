// Tests of the command eval: the objects that it compares, and its output.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "client_libs/cli/run.h"
#include "client_libs/testing/scripted_server.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::cli {
namespace {

using client::Script;
using client::ScriptedServer;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// A square of 1 m with its lower left corner at (x, y).
json Square(double x, double y) {
  return {{"type", "Polygon"},
          {"coordinates", {{{x, y}, {x + 1, y}, {x + 1, y + 1}, {x, y + 1}, {x, y}}}}};
}

json Feature(json properties, double x, double y) {
  return {{"type", "Feature"}, {"properties", std::move(properties)}, {"geometry", Square(x, y)}};
}

void AddObject(v1::LayerPart& part, const std::string& label, double x, double y,
               double existence) {
  v1::Object* object = part.add_objects();
  object->set_id(part.objects_size());
  object->set_label(label);
  object->set_existence(existence);
  for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
    v1::Ring* ring = object->mutable_shape()->mutable_polygon()->mutable_outer();
    ring->add_xs(x + dx);
    ring->add_ys(y + dy);
  }
}

struct EvalOutcome {
  int exit_code;
  std::string out;
  std::string err;
};

class EvalTest : public ::testing::Test {
 protected:
  EvalTest() {
    // A chair half a metre off, a second chair that overlaps it, a TV with another name, and a
    // plant that does not exist.
    v1::LayerPart part;
    part.set_layer("things");
    part.set_kind(v1::LAYER_KIND_SEMANTIC);
    part.set_status(v1::ANSWER_STATUS_VALUE);
    AddObject(part, "chair", 0.5, 0, 0.9);
    AddObject(part, "chair", 0.75, 0, 0.6);
    AddObject(part, "TVmonitor", 5, 5, 0.9);
    AddObject(part, "plant", 9, 9, 0.2);
    script_.parts = {part};
    script_.revision = 7;
    v1::Layer* layer = script_.layers.add_layers();
    layer->set_name("things");
    layer->set_kind(v1::LAYER_KIND_SEMANTIC);
    v1::ValueAlias* alias = layer->add_aliases();
    alias->set_alias("tv");
    alias->add_labels("tvmonitor");
  }

  std::string Path(const std::string& name) const { return folder_ / name; }

  std::string PutTruth(const json& features, const std::string& frame = "site") {
    std::ofstream(Path("truth.geojson"))
        << json{{"type", "FeatureCollection"}, {"frame", frame}, {"features", features}};
    return Path("truth.geojson");
  }

  std::string PutTruthOfTheScene() {
    return PutTruth(
        {Feature({{"label", "Chair"}, {"detectable", true}, {"visible_frames", 5}}, 0, 0),
         Feature({{"label", "tv"}}, 5, 5),
         Feature({{"label", "chair"}, {"visible_frames", 4}}, 20, 0),
         Feature({{"label", "desk"}, {"detectable", false}}, 30, 0)});
  }

  EvalOutcome RunEval(std::vector<std::string> args) {
    server_ = std::make_unique<ScriptedServer>(script_);
    args.insert(args.begin(),
                {"--server", server_->address(), "eval", "office", "--layer", "things"});
    std::ostringstream out, err;
    std::istringstream in;
    const int exit_code = cli::Run(args, in, out, err);
    return {exit_code, out.str(), err.str()};
  }

  testing::TemporaryFolder folder_;
  Script script_;
  std::unique_ptr<ScriptedServer> server_;
};

TEST_F(EvalTest, ComparesTheLayerWithWhatCountsOfTheTruth) {
  const EvalOutcome outcome = RunEval({"--truth", PutTruthOfTheScene(), "--json"});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  const json answer = json::parse(outcome.out);
  EXPECT_EQ(answer["revision"], 7);
  EXPECT_EQ(answer["n_truth"], 2);
  EXPECT_EQ(answer["truth_ignored"], 2);
  EXPECT_EQ(answer["n_map"], 4);
  EXPECT_EQ(answer["tp"], 2);
  EXPECT_EQ(answer["recall"], 1.0);
  EXPECT_EQ(answer["precision"], 0.5);
  EXPECT_DOUBLE_EQ(answer["f1"], 2.0 / 3);
  EXPECT_DOUBLE_EQ(answer["pq"], (1.0 / 3 + 1.0) / 3.0);
  EXPECT_DOUBLE_EQ(answer["pq_iou25"], (1.0 / 3 + 1.0) / 3.0);
  EXPECT_DOUBLE_EQ(answer["mean_iou"], 2.0 / 3);
  EXPECT_DOUBLE_EQ(answer["mean_iou_large"], 2.0 / 3);
  EXPECT_EQ(answer["mean_iou_small"], 0.0);
  EXPECT_DOUBLE_EQ(answer["centroid_error_m"], 0.25);
  EXPECT_EQ(answer["duplicates"], 1);
  EXPECT_EQ(answer["spurious"], 1);
  EXPECT_EQ(answer["per_class"][0], (json{{"label", "chair"},
                                          {"truth", 1},
                                          {"map", 2},
                                          {"detected", 1},
                                          {"mean_iou", 1.0 / 3},
                                          {"centroid_error_m", 0.5}}));
  EXPECT_EQ(answer["calibration"]["bins"].size(), 3u);
}

TEST_F(EvalTest, AsksForTheLayerInTheFrameOfTheTruth) {
  const EvalOutcome outcome = RunEval({"--truth", PutTruthOfTheScene()});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(server_->Requests(),
              ElementsAre(StartsWith("GetLayer map: \"office\" layer: \"things\""),
                          StartsWith("QueryArea scope { map: \"office\" layers: \"things\" "
                                     "frame_id: \"site\" } area")));
}

TEST_F(EvalTest, LineStringsAndPointsAreLeftOutAndCounted) {
  v1::Object* dock = script_.parts[0].add_objects();
  dock->set_id(9);
  dock->set_label("chair");
  dock->mutable_shape()->mutable_point()->set_x(0.5);
  const json line = {{"type", "LineString"}, {"coordinates", {{0, 0}, {1, 0}}}};
  const json point = {{"type", "Point"}, {"coordinates", {0.5, 0.5}}};
  const std::string truth =
      PutTruth({Feature({{"label", "chair"}}, 0, 0),
                Feature({{"label", "tv"}}, 5, 5),
                {{"type", "Feature"}, {"properties", {{"label", "chair"}}}, {"geometry", line}},
                {{"type", "Feature"}, {"properties", {{"label", "chair"}}}, {"geometry", point}}});
  const EvalOutcome outcome = RunEval({"--truth", truth, "--json"});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  const json answer = json::parse(outcome.out);
  EXPECT_EQ(answer["n_truth"], 2);
  EXPECT_EQ(answer["n_map"], 4);
  EXPECT_EQ(answer["tp"], 2);
  EXPECT_EQ(answer["truth_not_polygons"], 2);
  EXPECT_EQ(answer["map_not_polygons"], 1);
  EXPECT_EQ(answer["truth_ignored"], 0);
  EXPECT_THAT(RunEval({"--truth", truth}).out,
              HasSubstr("left out, because they are line strings or points: 2 true objects, "
                        "1 map object\n"));
}

TEST_F(EvalTest, LeastFramesCanBeSet) {
  const EvalOutcome outcome =
      RunEval({"--truth", PutTruthOfTheScene(), "--json", "--min_visible_frames", "4"});
  EXPECT_EQ(json::parse(outcome.out)["n_truth"], 3) << outcome.err;
}

TEST_F(EvalTest, PrintsATableForPeople) {
  const EvalOutcome outcome = RunEval({"--truth", PutTruthOfTheScene()});
  EXPECT_THAT(outcome.out, StartsWith("CLASS      TRUTH  DETECTED  MAP  MEAN IOU  CENTROID [m]\n"
                                      "chair          1         1    2     0.333           0.5\n"
                                      "plant          0         0    1\n"
                                      "tvmonitor      1         1    1         1             0\n"));
  EXPECT_THAT(outcome.out, HasSubstr("precision            0.5  2 of 4 map objects\n"));
  EXPECT_THAT(outcome.out, HasSubstr("0.2 to 0.3        1     0.2        0\n"));
}

TEST_F(EvalTest, DrawsAPicture) {
  const EvalOutcome outcome =
      RunEval({"--truth", PutTruthOfTheScene(), "--json", "--png", Path("out.png")});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out)["files"], json::array({Path("out.png")}));
  EXPECT_GT(std::filesystem::file_size(Path("out.png")), 1000u);
}

TEST_F(EvalTest, ALiveLayerMayBeTheTruth) {
  const EvalOutcome outcome =
      RunEval({"--truth-map", "surveyed", "--truth-layer", "by_hand", "--json"});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(
      server_->Requests(),
      ElementsAre(StartsWith("QueryArea scope { map: \"surveyed\" layers: \"by_hand\" } area"),
                  StartsWith("GetLayer"), StartsWith("QueryArea scope { map: \"office\"")));
  EXPECT_EQ(json::parse(outcome.out)["f1"], 1.0);
}

TEST_F(EvalTest, WhatCannotBeComparedIsToldInOneLine) {
  std::ofstream(Path("bad.geojson")) << "{";
  EXPECT_THAT(RunEval({"--truth", Path("bad.geojson")}).err,
              StartsWith("hypermap: INVALID_ARGUMENT: " + Path("bad.geojson") + ": not JSON"));
  EXPECT_THAT(RunEval({"--truth", Path("none.geojson")}).err, StartsWith("hypermap: NOT_FOUND"));
  script_.parts[0].clear_objects();
  script_.parts[0].set_status(v1::ANSWER_STATUS_NO_TRANSFORM);
  EXPECT_THAT(RunEval({"--truth", PutTruthOfTheScene()}).err,
              HasSubstr("layer \"things\" has no transform to the frame \"site\""));
  script_.parts[0].set_kind(v1::LAYER_KIND_OCCUPANCY);
  EXPECT_THAT(RunEval({"--truth", PutTruthOfTheScene()}).err, HasSubstr("holds no objects"));
}

}  // namespace
}  // namespace hypermap::cli
