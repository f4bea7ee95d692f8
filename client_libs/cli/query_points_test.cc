// Tests of query points: requests and output.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client_libs/cli/testing/run.h"
#include "client_libs/testing/scripted_server.h"
#include "google/protobuf/text_format.h"

namespace hypermap::cli {
namespace {

using client::Script;
using client::ScriptedServer;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

std::vector<std::string> LinesOf(const std::string& text) { return absl::StrSplit(text, '\n'); }

Script TwoPoints() {
  Script script;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(
      "revision: 5 new_labels: ['cup', 'table'] "
      "layers { layer: 'adrift' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_NO_TRANSFORM } "
      "layers { layer: 'floor' kind: LAYER_KIND_OCCUPANCY status: ANSWER_STATUS_VALUE "
      "statuses: [ANSWER_STATUS_VALUE, ANSWER_STATUS_OUTSIDE] values: [0.25, nan] } "
      "layers { layer: 'things' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE "
      "points: [1, 1] object_ids: [7, 9] labels: [0, 1] existences: [0.97, 1] }",
      &script.points.emplace_back()));
  return script;
}

TEST(QueryPointsCommandTest, JsonHasALineAPointThenTheRevision) {
  ScriptedServer server(TwoPoints());
  const Outcome outcome = RunOn(server,
                                {"query", "points", "office", "--stdin", "--layer", "a", "--frame",
                                 "dock", "--at", "5", "--tolerance", "0.5", "--json"},
                                "1 2\n-0.5,4\n");
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(
      LinesOf(outcome.out),
      ElementsAre(
          R"({"point":[1.0,2.0],"layers":[)"
          R"({"layer":"adrift","status":"no_transform","value":null,"entities":[]},)"
          R"({"layer":"floor","status":"value","value":0.25,"entities":[]},)"
          R"({"layer":"things","status":"value","value":null,"entities":[]}]})",
          R"({"point":[-0.5,4.0],"layers":[)"
          R"({"layer":"adrift","status":"no_transform","value":null,"entities":[]},)"
          R"({"layer":"floor","status":"outside","value":null,"entities":[]},)"
          R"({"layer":"things","status":"value","value":null,"entities":[)"
          R"({"id":7,"label":"cup","existence":0.97},{"id":9,"label":"table","existence":1.0}]}]})",
          R"({"revision":5})", ""));
  EXPECT_THAT(server.Requests(),
              ElementsAre("QueryPoints opening { scope { map: \"office\" layers: \"a\" frame_id: "
                          "\"dock\" } as_of { at_revision: 5 } tolerance_m: 0.5 } xs: 1 xs: -0.5 "
                          "ys: 2 ys: 4"));
}

TEST(QueryPointsCommandTest, PeopleGetALineAPoint) {
  ScriptedServer server(TwoPoints());
  const Outcome outcome = RunOn(server, {"query", "points", "office", "--stdin"}, "1 2\n-0.5,4\n");
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  const std::vector<std::string> lines = LinesOf(outcome.out);
  ASSERT_THAT(lines, SizeIs(::testing::Ge(3)));
  EXPECT_THAT(lines[0], HasSubstr("adrift: no transform to its frame"));
  EXPECT_THAT(lines[0], HasSubstr("things: nothing"));
  EXPECT_THAT(lines[1], HasSubstr("floor: outside of the layer"));
  EXPECT_THAT(lines[1], HasSubstr("things: cup (id 7), table (id 9)"));
  EXPECT_THAT(outcome.out, HasSubstr("2 points"));
}

TEST(QueryPointsCommandTest, ManyPointsAreAskedInBatchesAndPrintedInOrder) {
  Script script;
  std::string input;
  constexpr int kPoints = 5000;
  for (int i = 0; i < kPoints; ++i) absl::StrAppend(&input, i, " 0.5\n");
  for (int left = kPoints; left > 0; left -= 1024) {
    v1::QueryPointsResponse& response = script.points.emplace_back();
    response.set_revision(3);
  }
  ScriptedServer server(script);
  const Outcome outcome = RunOn(server, {"query", "points", "office", "--stdin", "--json"}, input);
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  const std::vector<std::string> lines = LinesOf(outcome.out);
  ASSERT_THAT(lines, SizeIs(kPoints + 2));
  for (int i = 0; i < kPoints; ++i) {
    ASSERT_EQ(lines[i], absl::StrCat("{\"point\":[", i, ".0,0.5],\"layers\":[]}"));
  }
  EXPECT_EQ(lines[kPoints], "{\"revision\":3}");
  EXPECT_THAT(server.Requests(), SizeIs(5));
}

TEST(QueryPointsCommandTest, AWrongLineEndsItAfterThePointsBeforeIt) {
  ScriptedServer server(TwoPoints());
  const Outcome outcome = RunOn(server, {"query", "points", "office", "--stdin", "--json"},
                                "1 2\n3 4\nfive six\n7 8\n");
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, HasSubstr("line 3: \"five six\" is not of the form X Y"));
  EXPECT_THAT(LinesOf(outcome.out), SizeIs(3));
}

TEST(QueryPointsCommandTest, ErrorsOfTheServerAreToldAlsoWithoutPoints) {
  Script script;
  script.status = grpc::Status(grpc::StatusCode::NOT_FOUND, "map \"x\" does not exist");
  ScriptedServer server(script);
  for (const char* input : {"", "1 2\n"}) {
    const Outcome outcome = RunOn(server, {"query", "points", "x", "--stdin"}, input);
    EXPECT_EQ(outcome.exit_code, kExitError);
    EXPECT_THAT(outcome.err, HasSubstr("map \"x\" does not exist"));
    EXPECT_EQ(outcome.out, "");
  }
  EXPECT_EQ(RunOn(server, {"query", "points", "x"}).exit_code, kExitUsage);
}

}  // namespace
}  // namespace hypermap::cli
