// Tests of the command transform estimate: requests, output, picture, exit codes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "client_libs/cli/canvas.h"
#include "client_libs/cli/testing/image.h"
#include "client_libs/cli/testing/run.h"
#include "client_libs/cli/transform_image.h"
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
using ::testing::SizeIs;
using ::testing::StartsWith;

constexpr char kAmbiguous[] = "ambiguity: TRANSFORM_AMBIGUITY_RUNNER_UP";
constexpr char kClear[] = "ambiguity: TRANSFORM_AMBIGUITY_NONE";

Script Answers(const std::string& ambiguity) {
  Script script;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(
      "source { map: 'attic' layer: 'floor' frame_id: 'map' revision: 3 incarnation: 8 } "
      "target { map: 'office' layer: 'floor' frame_id: 'map' revision: 12 incarnation: 9 } "
      "best { target_from_source { x: 2 y: -1.5 yaw: 0.25 } score: 0.9 } "
      "covariance: [0.0001, 0, 0, 0, 0.0004, 0, 0, 0, 0.000001] inlier_share: 0.97 "
      "runner_up { target_from_source { x: 4 y: 1 yaw: -3 } score: 0.5 } " +
          ambiguity,
      &script.transform));
  return script;
}

// The parts that answer each query: the floor of both maps, one free cell and one occupied.
void AddFloor(Script* script) {
  script->parts.emplace_back();
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(
      "layer: 'floor' kind: LAYER_KIND_OCCUPANCY status: ANSWER_STATUS_VALUE "
      "cells { grid { origin { } resolution_m: 1 } rows: [0, 0] col_begins: [0, 1] "
      "col_ends: [1, 2] values: [0, 1] }",
      &script->parts.back()));
}

class EstimateTest : public ::testing::Test {
 protected:
  static Outcome Estimate(const ScriptedServer& server, Args args) {
    args.insert(args.begin(), {"transform", "estimate", "attic", "office"});
    return RunOn(server, std::move(args));
  }

  testing::TemporaryFolder folder_;
};

TEST_F(EstimateTest, PrintsTheTransformAndHowFarItCanBeTrusted) {
  ScriptedServer server(Answers(kClear));
  const Outcome outcome = Estimate(server, {"--layer", "floor"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(outcome.out,
            "TRANSFORM           X [m]  Y [m]  YAW [rad]  SCORE\n"
            "best                    2   -1.5       0.25    0.9\n"
            "standard deviation   0.01   0.02      0.001\n"
            "runner-up               4      1         -3    0.5\n"
            "\n"
            "97 % of what can be compared agrees; not ambiguous\n"
            "attic/floor in map, revision 3 over office/floor in map, revision 12\n");
  EXPECT_THAT(server.Requests(),
              ElementsAre("EstimateTransform source { scope { map: \"attic\" layers: \"floor\" } } "
                          "target { scope { map: \"office\" layers: \"floor\" } }"));
}

TEST_F(EstimateTest, PrintsJson) {
  ScriptedServer server(Answers(kAmbiguous));
  const Outcome outcome = Estimate(server, {"--layer", "floor", "--json"});
  EXPECT_EQ(json::parse(outcome.out), json::parse(R"({
    "source": {"map": "attic", "layer": "floor", "frame_id": "map", "revision": 3},
    "target": {"map": "office", "layer": "floor", "frame_id": "map", "revision": 12},
    "target_from_source": [2.0, -1.5, 0.25],
    "covariance": [[0.0001, 0.0, 0.0], [0.0, 0.0004, 0.0], [0.0, 0.0, 0.000001]],
    "score": 0.9, "inlier_share": 0.97,
    "runner_up": {"target_from_source": [4.0, 1.0, -3.0], "score": 0.5},
    "ambiguity": "runner_up", "agreeing": []})"));
}

TEST_F(EstimateTest, AmbiguousAnswersHaveAnExitCodeOfTheirOwn) {
  ScriptedServer server(Answers(kAmbiguous));
  const Outcome ambiguous = Estimate(server, {"--layer", "floor"});
  EXPECT_EQ(ambiguous.exit_code, 1);
  EXPECT_THAT(ambiguous.out, HasSubstr("ambiguous: the runner-up is about as good"));
  EXPECT_THAT(ambiguous.err, IsEmpty());
  Script broken = Answers(kClear);
  broken.status = grpc::Status(grpc::StatusCode::FAILED_PRECONDITION, "other kinds");
  ScriptedServer failing(broken);
  const Outcome failed = Estimate(failing, {"--layer", "floor"});
  EXPECT_EQ(failed.exit_code, 2);
  EXPECT_THAT(failed.err, HasSubstr("other kinds"));
}

TEST_F(EstimateTest, LayersFramesAndRevisionsOfTheSidesDiffer) {
  ScriptedServer server(Answers(kClear));
  const Outcome outcome = Estimate(
      server, {"--source-layer", "a", "--target_layer", "b", "--source_frame", "f",
               "--target-frame", "g", "--source-at", "7", "--target-at", "1970-01-01T00:00:01Z"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(
      server.Requests(),
      ElementsAre("EstimateTransform source { scope { map: \"attic\" layers: \"a\" frame_id: \"f\" "
                  "} as_of { at_revision: 7 } } target { scope { map: \"office\" layers: \"b\" "
                  "frame_id: \"g\" } as_of { at_time { seconds: 1 } } }"));
}

TEST_F(EstimateTest, PairsComeFromAFile) {
  Script script = Answers(kClear);
  script.transform.clear_covariance();
  v1::AgreeingPair* const agreeing = script.transform.add_agreeing();
  agreeing->set_source(1);
  agreeing->set_target(1);
  ScriptedServer server(script);
  const std::string path = folder_ / "pairs.csv";
  Put(path, "door,0,0,9,-1.5\n,0,0,2,-1.5\n");
  const Outcome outcome = Estimate(server, {"--pairs", path});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("PAIR  RESIDUAL [m]  AGREES\n"
                                     "door             7  no\n"
                                     "2                0  yes\n"));
  ASSERT_THAT(server.Requests(), SizeIs(1));
  EXPECT_THAT(server.Requests()[0],
              StartsWith("EstimateTransform source { scope { map: \"attic\" } } target { scope { "
                         "map: \"office\" } } pairs { name: \"door\" source { } target { x: 9 y: "
                         "-1.5 } sigma_m: 0.05 }"));
  Put(path, "door,1,2,3\n");
  const Outcome wrong = Estimate(server, {"--pairs", path});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("pairs.csv: line 1"));
}

TEST_F(EstimateTest, WithoutLayersOrPairsThereIsNothingToCompare) {
  ScriptedServer server(Answers(kClear));
  for (const Args& args : {Args{}, Args{"--source_layer", "floor"}, Args{"--layer", "a", "--force"},
                           Args{"--layer", "a", "--child", "b"}}) {
    const Outcome outcome = Estimate(server, args);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, StartsWith("hypermap: "));
  }
  EXPECT_THAT(server.Requests(), IsEmpty());
}

TEST_F(EstimateTest, DrawsTheSourceOverTheTarget) {
  Script script = Answers(kClear);
  AddFloor(&script);
  ScriptedServer server(script);
  const std::string path = folder_ / "over.png";
  const Outcome outcome = Estimate(server, {"--layer", "floor", "--output", path});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("wrote " + path + "\n"));
  const Pixels pixels(Get(path));
  EXPECT_GT(pixels.width(), 1000);
  ASSERT_THAT(server.Requests(), SizeIs(3));
  EXPECT_THAT(server.Requests()[1],
              StartsWith("QueryValue scope { map: \"attic\" layers: \"floor\" frame_id: \"map\" "
                         "incarnation: 8 } as_of { at_revision: 3"));
  EXPECT_THAT(server.Requests()[2],
              StartsWith("QueryArea scope { map: \"office\" layers: \"floor\" frame_id: \"map\" "
                         "incarnation: 9 } as_of { at_revision: 12"));
}

TEST_F(EstimateTest, AppliesOnlyWhenAsked) {
  ScriptedServer server(Answers(kClear));
  const Outcome outcome = Estimate(server, {"--layer", "floor", "--apply"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("office frame attic set in map, revision 1\n"));
  ASSERT_THAT(server.Requests(), SizeIs(2));
  EXPECT_EQ(server.Requests()[1],
            "SetTransform map: \"office\" transform { parent_frame_id: \"map\" child_frame_id: "
            "\"attic\" parent_from_child { x: 2 y: -1.5 yaw: 0.25 } } incarnation: 9");
}

TEST_F(EstimateTest, ChildIsTheSourcesFrameOrAsNamed) {
  Script script = Answers(kClear);
  script.transform.mutable_source()->set_frame_id("robot1");
  ScriptedServer server(script);
  EXPECT_EQ(Estimate(server, {"--layer", "floor", "--apply"}).exit_code, kExitOk);
  EXPECT_THAT(server.Requests()[1], HasSubstr("child_frame_id: \"robot1\""));
  EXPECT_EQ(Estimate(server, {"--layer", "floor", "--apply", "--child", "r"}).exit_code, kExitOk);
  EXPECT_THAT(server.Requests()[3], HasSubstr("child_frame_id: \"r\""));
  // Two layers in one frame of one map.
  script.transform.mutable_target()->set_map("attic");
  script.transform.mutable_source()->set_frame_id("map");
  ScriptedServer same(script);
  const Outcome outcome = Estimate(same, {"--layer", "floor", "--apply"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("--child"));
  EXPECT_THAT(same.Requests(), SizeIs(1));
}

TEST_F(EstimateTest, AmbiguousAnswersAreAppliedByForceOnly) {
  ScriptedServer server(Answers(kAmbiguous));
  const Outcome refused = Estimate(server, {"--layer", "floor", "--apply"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("not applied: ambiguous: the runner-up"));
  EXPECT_THAT(refused.out, HasSubstr("runner-up"));
  EXPECT_THAT(server.Requests(), SizeIs(1));
  const Outcome forced = Estimate(server, {"--layer", "floor", "--apply", "--force", "--json"});
  EXPECT_EQ(forced.exit_code, kExitOk) << forced.err;
  EXPECT_EQ(json::parse(forced.out)["applied"], json::parse(R"({"parent_frame_id": "map",
    "child_frame_id": "attic", "parent_from_child": [2.0, -1.5, 0.25], "revision": 1})"));
}

TEST(TransformImageTest, TargetIsGreyAndSourceIsColoured) {
  // The occupied cell of the source, (0, 0) to (1, 1), lies at (4, 2) to (3, 3) of the target.
  TransformScene scene;
  scene.target = {"office", GridGeometry{{}, 1.0}, {{0, 0, 1, 0.0}, {0, 1, 2, 1.0}}, {}};
  scene.source = {"attic", GridGeometry{{}, 1.0}, {{0, 0, 1, 1.0}}, {}};
  scene.target_from_source = PlanarTransform(4, 2, M_PI / 2);
  const auto image = DrawTransform(scene);
  ASSERT_TRUE(image.ok()) << image.status();
  const Pixels pixels(image->png);
  EXPECT_EQ(pixels.width(), image->width);
  // The plan shows (-0.5, -0.5) to (4.5, 3.5), 1600 pixels wide.
  const auto at = [&](double x, double y) {
    return pixels.At(static_cast<int>(kMargin + 320 * (x + 0.5)),
                     static_cast<int>(kMargin + 320 * (3.5 - y)));
  };
  EXPECT_EQ(at(1.5, 0.5), RgbOf(kTargetColour));
  EXPECT_EQ(at(0.5, 0.5), 0xF8F8F8u);
  EXPECT_EQ(at(2.5, 2.5), 0xFFFFFFu);
  const uint32_t source = at(3.5, 2.5);
  EXPECT_GT(source >> 16, 0xE0u);
  EXPECT_LT(source & 0xFF, 0x60u);
}

TEST(TransformImageTest, ObjectsAndPairsAreDrawn) {
  TransformScene scene;
  scene.target.shapes = {Shape(Polygon::FromBox({{0, 0}, {2, 2}}))};
  scene.source.shapes = {Shape(Polygon::FromBox({{0, 0}, {2, 2}}))};
  scene.pairs = {{{0, 0}, {3, 3}, false}, {{1, 1}, {1, 1}, true}};
  const auto image = DrawTransform(scene);
  ASSERT_TRUE(image.ok()) << image.status();
  const Pixels pixels(image->png);
  const auto at = [&](double x, double y) {
    return pixels.At(static_cast<int>(kMargin + 400 * (x + 0.5)),
                     static_cast<int>(kMargin + 400 * (3.5 - y)));
  };
  EXPECT_EQ(at(3, 3), RgbOf(kTargetColour)) << "the disc of a point";
  EXPECT_EQ(at(1, 1), RgbOf(kSourceColour)) << "the cross of a point";
  const uint32_t inside = at(1.5, 0.5);
  EXPECT_NE(inside, 0xFFFFFFu) << "the target's object";
  EXPECT_EQ(inside >> 16, inside & 0xFF) << "which is grey";
}

TEST(TransformImageTest, NothingIsNoPicture) {
  EXPECT_TRUE(absl::IsFailedPrecondition(DrawTransform({}).status()));
}

}  // namespace
}  // namespace hypermap::cli
