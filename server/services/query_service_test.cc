#include "server/services/query_service.h"

#include <gmock/gmock.h>
#include <google/protobuf/unknown_field_set.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "base/limits/limits.h"
#include "server/services/testing/test_server.h"
#include "wire/geometry.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

// The map "site" with the layers "cups" and "cells", at revision 1.
class QueryServiceTest : public ::testing::Test {
 protected:
  static Limits SmallLimits() {
    Limits limits;
    limits.chunk_items = 3;
    limits.max_nearest = 4;
    limits.max_question_vertices = 8;
    return limits;
  }

  QueryServiceTest() : server_(SmallLimits()) {
    EditBatch batch = LayerOfCups("cups", 10);
    const EditBatch cells = LayerOfCells("cells", 2, 4);
    batch.edits.insert(batch.edits.end(), cells.edits.begin(), cells.edits.end());
    server_.MakeMap("site", std::move(batch));
  }

  static v1::QueryAreaRequest AreaRequest(const Box& box) {
    v1::QueryAreaRequest request;
    request.mutable_scope()->set_map("site");
    wire::EncodePolygon(Polygon::FromBox(box), request.mutable_area());
    return request;
  }

  // The error of a QueryArea call.
  grpc::Status AreaError(const v1::QueryAreaRequest& request) {
    grpc::ClientContext context;
    auto reader = server_.query->QueryArea(&context, request);
    EXPECT_TRUE(ReadAll(*reader).empty());
    return reader->Finish();
  }

  TestServer server_;
};

TEST_F(QueryServiceTest, PointIsAnsweredByEveryLayer) {
  v1::QueryPointRequest request;
  request.mutable_scope()->set_map("site");
  wire::EncodePoint({0.5, 0.5}, request.mutable_point());
  v1::QueryPointResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(server_.query->QueryPoint(&context, request, &response).ok());
  EXPECT_EQ(response.map(), "site");
  EXPECT_EQ(response.revision(), 1);
  EXPECT_EQ(response.frame_id(), "map");
  ASSERT_EQ(response.layers_size(), 2);
  EXPECT_EQ(response.layers(0).layer(), "cells");
  EXPECT_EQ(response.layers(0).value(), 0.0);
  EXPECT_EQ(response.layers(1).layer(), "cups");
  ASSERT_EQ(response.layers(1).objects_size(), 1);
  EXPECT_EQ(response.layers(1).objects(0).label(), "cup");
}

TEST_F(QueryServiceTest, AreaComesInPartsOfBoundedSizeLayerAfterLayer) {
  grpc::ClientContext context;
  auto reader = server_.query->QueryArea(&context, AreaRequest({{0, 0}, {100, 100}}));
  const auto responses = ReadAll(*reader);
  ASSERT_TRUE(reader->Finish().ok());
  std::vector<std::string> layers;
  int objects = 0, runs = 0;
  for (const v1::QueryAreaResponse& response : responses) {
    EXPECT_EQ(response.revision(), 1);
    const v1::LayerPart& part = response.part();
    EXPECT_LE(part.objects_size(), 3);
    EXPECT_LE(part.cells().rows_size(), 3);
    objects += part.objects_size();
    runs += part.cells().rows_size();
    if (layers.empty() || layers.back() != part.layer()) layers.push_back(part.layer());
  }
  EXPECT_THAT(layers, ::testing::ElementsAre("cells", "cups"));
  EXPECT_EQ(objects, 10);
  EXPECT_EQ(runs, 8);
}

TEST_F(QueryServiceTest, LayerWithoutMatchesAnswersWithOneEmptyPart) {
  grpc::ClientContext context;
  auto reader = server_.query->QueryArea(&context, AreaRequest({{500, 500}, {501, 501}}));
  const auto responses = ReadAll(*reader);
  ASSERT_TRUE(reader->Finish().ok());
  ASSERT_EQ(responses.size(), 2u);
  for (const v1::QueryAreaResponse& response : responses) {
    EXPECT_EQ(response.part().status(), v1::ANSWER_STATUS_VALUE);
    EXPECT_EQ(response.part().objects_size() + response.part().cells().rows_size(), 0);
  }
}

TEST_F(QueryServiceTest, LayerThatCannotTakeTheValueSaysSoAndTheOtherAnswers) {
  v1::QueryValueRequest request;
  request.mutable_scope()->set_map("site");
  request.set_value("Occupied");
  grpc::ClientContext context;
  auto reader = server_.query->QueryValue(&context, request);
  const auto responses = ReadAll(*reader);
  ASSERT_TRUE(reader->Finish().ok());
  int runs = 0;
  for (const v1::QueryValueResponse& response : responses) {
    runs += response.part().cells().rows_size();
  }
  EXPECT_EQ(runs, 4);
  EXPECT_EQ(responses.back().part().layer(), "cups");
  EXPECT_EQ(responses.back().part().status(), v1::ANSWER_STATUS_UNSUPPORTED_VALUE);
}

TEST_F(QueryServiceTest, NearestMatchesComeNearestFirst) {
  v1::QueryNearestRequest request;
  request.mutable_scope()->set_map("site");
  request.mutable_scope()->add_layers("cups");
  request.set_value("cup");
  request.set_k(2);
  wire::EncodePoint({4.5, 3.0}, request.mutable_point());
  v1::QueryNearestResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(server_.query->QueryNearest(&context, request, &response).ok());
  EXPECT_EQ(response.revision(), 1);
  ASSERT_EQ(response.matches_size(), 2);
  EXPECT_EQ(response.matches(0).distance_m(), 2.0);
  EXPECT_GT(response.matches(1).distance_m(), 2.0);
}

TEST_F(QueryServiceTest, BadPointRequestsNameTheField) {
  v1::QueryPointRequest good;
  good.mutable_scope()->set_map("site");
  good.mutable_point()->set_x(1.0);
  v1::QueryPointRequest no_map = good, bad_map = good, no_point = good, nan = good;
  v1::QueryPointRequest unknown_map = good, unknown_layer = good, unknown_frame = good;
  no_map.mutable_scope()->clear_map();
  bad_map.mutable_scope()->set_map("../site");
  unknown_map.mutable_scope()->set_map("attic");
  no_point.clear_point();
  nan.mutable_point()->set_y(std::numeric_limits<double>::quiet_NaN());
  unknown_layer.mutable_scope()->add_layers("floor");
  unknown_frame.mutable_scope()->set_frame_id("moon");
  const struct {
    v1::QueryPointRequest request;
    grpc::StatusCode code;
    const char* message;
  } cases[] = {
      {no_map, grpc::StatusCode::INVALID_ARGUMENT, "map is empty"},
      {bad_map, grpc::StatusCode::INVALID_ARGUMENT, "map must"},
      {unknown_map, grpc::StatusCode::NOT_FOUND, "attic"},
      {no_point, grpc::StatusCode::INVALID_ARGUMENT, "point is missing"},
      {nan, grpc::StatusCode::INVALID_ARGUMENT, "point is not finite"},
      {unknown_layer, grpc::StatusCode::NOT_FOUND, "floor"},
      {unknown_frame, grpc::StatusCode::NOT_FOUND, "moon"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.message);
    v1::QueryPointResponse response;
    grpc::ClientContext context;
    const grpc::Status status = server_.query->QueryPoint(&context, c.request, &response);
    EXPECT_EQ(status.error_code(), c.code);
    EXPECT_THAT(status.error_message(), HasSubstr(c.message));
  }
}

TEST_F(QueryServiceTest, BadAreasNameTheField) {
  v1::QueryAreaRequest no_area;
  no_area.mutable_scope()->set_map("site");
  EXPECT_EQ(AreaError(no_area).error_message(), "area is missing");
  v1::QueryAreaRequest two_points = AreaRequest({{0, 0}, {1, 1}});
  two_points.mutable_area()->mutable_outer()->mutable_xs()->Truncate(2);
  two_points.mutable_area()->mutable_outer()->mutable_ys()->Truncate(2);
  EXPECT_EQ(AreaError(two_points).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  v1::QueryAreaRequest many_points = AreaRequest({{0, 0}, {1, 1}});
  for (int i = 0; i < 5; ++i) many_points.mutable_area()->mutable_outer()->add_xs(0.0);
  EXPECT_EQ(AreaError(many_points).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(AreaError(many_points).error_message(),
              HasSubstr("area has 9 vertices, --max_question_vertices is 8"));
}

TEST_F(QueryServiceTest, BytesThatAreNoRequestAreRefused) {
  v1::QueryAreaRequest request = AreaRequest({{0, 0}, {1, 1}});
  // The bytes of the polygon are invalid: a tag that does not end.
  request.GetReflection()->MutableUnknownFields(&request)->AddLengthDelimited(
      v1::QueryAreaRequest::kAreaFieldNumber, "\xff");
  const grpc::Status status = AreaError(request);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), "the request is not a hypermap.v1.QueryAreaRequest");
}

TEST_F(QueryServiceTest, NearestBeyondTheLimitNamesIt) {
  v1::QueryNearestRequest request;
  request.mutable_scope()->set_map("site");
  request.set_value("cup");
  request.mutable_point();
  request.set_k(5);
  v1::QueryNearestResponse response;
  grpc::ClientContext context;
  const grpc::Status status = server_.query->QueryNearest(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("--max_nearest"));
}

TEST_F(QueryServiceTest, QuestionsAreAnsweredWhileAWriteWaits) {
  server_.disk().Hold();
  auto session = *server_.site().Find("site");
  session->Submit({LayerOfCups("more", 1), "test", ""}, [](absl::StatusOr<storage::Receipt>) {});
  server_.disk().AwaitHeldWrite();
  v1::QueryPointRequest request;
  request.mutable_scope()->set_map("site");
  request.mutable_point();
  v1::QueryPointResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(server_.query->QueryPoint(&context, request, &response).ok());
  EXPECT_EQ(response.revision(), 1);
  server_.disk().Release();
}

}  // namespace
}  // namespace hypermap::server
