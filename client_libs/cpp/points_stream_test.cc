#include "client_libs/cpp/points_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "client_libs/cpp/client.h"
#include "client_libs/testing/scripted_server.h"
#include "google/protobuf/text_format.h"

namespace hypermap::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

v1::QueryPointsResponse Response(const std::string& text) {
  v1::QueryPointsResponse message;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &message)) << text;
  return message;
}

// Answers a batch of two points, then a batch of one point.
Script TwoAnswers() {
  Script script;
  script.points = {
      Response("revision: 5 new_labels: 'cup' "
               "layers { layer: 'floor' kind: LAYER_KIND_OCCUPANCY status: ANSWER_STATUS_VALUE "
               "statuses: [ANSWER_STATUS_VALUE, ANSWER_STATUS_OUTSIDE] values: [0.25, nan] } "
               "layers { layer: 'things' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE "
               "points: 1 object_ids: 7 labels: 0 existences: 0.5 }"),
      Response("revision: 6 new_labels: 'chair' "
               "layers { layer: 'things' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE "
               "points: [0, 0] object_ids: [7, 9] labels: [0, 1] existences: [0.5, 1] }")};
  return script;
}

TEST(PointsStreamTest, AnswersHaveWhatEachLayerSaysOfEachPoint) {
  ScriptedServer server(TwoAnswers());
  Client client(server.address());
  const auto stream =
      client.QueryPoints("office", {{"floor", "things"}, "dock"}, {.as_of = {.min_revision = 5}});

  const auto first = stream->Ask(std::vector<Point>{{1, 2}, {3, 4}});
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->revision, 5);
  EXPECT_EQ(first->num_points, 2u);
  ASSERT_THAT(first->layers, SizeIs(2));
  EXPECT_EQ(first->layers[0].layer, "floor");
  EXPECT_EQ(first->layers[0].kind, LayerKind::kOccupancy);
  EXPECT_THAT(first->layers[0].statuses, ElementsAre(AnswerStatus::kValue, AnswerStatus::kOutside));
  EXPECT_EQ(first->layers[0].values[0], 0.25);
  EXPECT_TRUE(std::isnan(first->layers[0].values[1]));
  ASSERT_THAT(first->layers[1].hits, SizeIs(1));
  EXPECT_EQ(first->layers[1].hits[0].point, 1u);

  const auto second = stream->Ask(std::vector<Point>{{5, 6}});
  ASSERT_TRUE(second.ok()) << second.status();
  ASSERT_THAT(second->layers[0].hits, SizeIs(2));
  EXPECT_EQ(second->layers[0].hits[0].label, "cup");
  EXPECT_EQ(second->layers[0].hits[1].label, "chair");
  EXPECT_EQ(first->layers[1].hits[0].label, "cup");

  const auto none = stream->Ask({});
  ASSERT_TRUE(none.ok());
  EXPECT_THAT(none->layers, IsEmpty());
  stream->WritesDone();
  EXPECT_EQ(stream->Read(), std::nullopt);
  EXPECT_TRUE(stream->status().ok()) << stream->status();
  EXPECT_THAT(server.Requests(),
              ElementsAre("QueryPoints opening { scope { map: \"office\" layers: \"floor\" "
                          "layers: \"things\" frame_id: \"dock\" } as_of { min_revision: 5 } } "
                          "xs: 1 xs: 3 ys: 2 ys: 4",
                          "QueryPoints xs: 5 ys: 6"));
}

TEST(PointsStreamTest, BatchesUnderWayAreAnsweredInOrder) {
  ScriptedServer server(TwoAnswers());
  Client client(server.address());
  const auto stream = client.QueryPoints("office");
  EXPECT_TRUE(stream->Write(std::vector<Point>{{1, 2}, {3, 4}}));
  EXPECT_TRUE(stream->Write(std::vector<Point>{{5, 6}}));
  stream->WritesDone();
  const auto first = stream->Read();
  const auto second = stream->Read();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->revision, 5);
  EXPECT_EQ(second->revision, 6);
  EXPECT_EQ(stream->Read(), std::nullopt);
  EXPECT_TRUE(stream->status().ok());
}

TEST(PointsStreamTest, ErrorsAreTheServersOwn) {
  Script script;
  script.status = grpc::Status(grpc::StatusCode::NOT_FOUND, "map \"x\" does not exist");
  ScriptedServer server(script);
  const absl::Status expected = absl::NotFoundError("map \"x\" does not exist");
  Client client(server.address());
  EXPECT_EQ(client.QueryPoints("x")->Ask(std::vector<Point>{{1, 2}}).status(), expected);
  // The same holds if no batch is written.
  const auto unasked = client.QueryPoints("x");
  unasked->WritesDone();
  EXPECT_EQ(unasked->Read(), std::nullopt);
  EXPECT_EQ(unasked->status(), expected);
}

TEST(PointsStreamTest, AnAnswerThatMakesNoSenseIsAnInternalError) {
  ScriptedServer server(TwoAnswers());
  Client client(server.address());
  const absl::Status status = client.QueryPoints("x")->Ask(std::vector<Point>{{1, 2}}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(status.message()), HasSubstr("floor"));
}

TEST(PointsStreamTest, AStreamThatIsCancelledOrGivenUpEnds) {
  ScriptedServer server(TwoAnswers());
  Client client(server.address());
  const auto cancelled = client.QueryPoints("x");
  cancelled->Cancel();
  EXPECT_EQ(cancelled->Ask(std::vector<Point>{{1, 2}}).status().code(),
            absl::StatusCode::kCancelled);
  const auto given_up = client.QueryPoints("x");
  EXPECT_TRUE(given_up->Write(std::vector<Point>{{1, 2}}));
}

}  // namespace
}  // namespace hypermap::client
