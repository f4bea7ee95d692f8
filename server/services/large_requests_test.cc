// Tests of requests that are too large to be parsed on gRPC's threads.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/services/testing/test_server.h"
#include "wire/edit.h"
#include "wire/geometry.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

// Adds a field that the server does not know.
template <typename Request>
Request Padded(Request request) {
  request.GetReflection()->MutableUnknownFields(&request)->AddLengthDelimited(
      15, std::string(100'000, 'x'));
  return request;
}

// The map "site" with the layer "cups", at revision 1.
class LargeRequestsTest : public ::testing::Test {
 protected:
  LargeRequestsTest() { server_.MakeMap("site", LayerOfCups("cups", 3)); }

  // Calls a unary rpc.
  template <typename Stub, typename Request, typename Response>
  static grpc::Status Call(Stub& stub,
                           grpc::Status (Stub::*rpc)(grpc::ClientContext*, const Request&,
                                                     Response*),
                           const Request& request, Response* response) {
    grpc::ClientContext context;
    return (stub.*rpc)(&context, request, response);
  }

  static v1::QueryPointRequest PointRequest(int64_t min_revision = 0) {
    v1::QueryPointRequest request;
    request.mutable_scope()->set_map("site");
    request.mutable_as_of()->set_min_revision(min_revision);
    wire::EncodePoint({0.5, 0.5}, request.mutable_point());
    return request;
  }
  static v1::QueryAreaRequest AreaRequest(int64_t min_revision = 0) {
    v1::QueryAreaRequest request;
    request.mutable_scope()->set_map("site");
    request.mutable_as_of()->set_min_revision(min_revision);
    wire::EncodePolygon(Polygon::FromBox({{-1, -1}, {3, 3}}), request.mutable_area());
    return request;
  }
  void Edit() {
    const EditBatch cup{{LayerOfCups("cups", 1).edits[1]}};
    ASSERT_TRUE((*server_.site().Find("site"))->SubmitAndWait({cup, "test", ""}).ok());
  }

  // The answers of a streamed rpc in one string; empty if it fails.
  template <typename Response>
  static std::string AnswerOf(std::unique_ptr<grpc::ClientReader<Response>> reader) {
    std::string answer;
    for (const Response& response : ReadAll(*reader)) {
      absl::StrAppend(&answer, response.ShortDebugString());
    }
    const grpc::Status status = reader->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
    return status.ok() ? answer : "";
  }

  TestServer server_;
};

TEST_F(LargeRequestsTest, QuestionsAreAnsweredLikeSmallOnes) {
  v1::QueryPointResponse small, large;
  ASSERT_TRUE(
      Call(*server_.query, &v1::QueryService::Stub::QueryPoint, PointRequest(), &small).ok());
  const grpc::Status status =
      Call(*server_.query, &v1::QueryService::Stub::QueryPoint, Padded(PointRequest()), &large);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(large.ShortDebugString(), small.ShortDebugString());
  EXPECT_EQ(large.layers(0).objects_size(), 1);

  v1::QueryNearestRequest nearest;
  nearest.mutable_scope()->set_map("site");
  wire::EncodePoint({0.5, 0.5}, nearest.mutable_point());
  nearest.set_value("cup");
  nearest.set_k(2);
  v1::QueryNearestResponse near_small, near_large;
  ASSERT_TRUE(
      Call(*server_.query, &v1::QueryService::Stub::QueryNearest, nearest, &near_small).ok());
  ASSERT_TRUE(
      Call(*server_.query, &v1::QueryService::Stub::QueryNearest, Padded(nearest), &near_large)
          .ok());
  EXPECT_EQ(near_large.ShortDebugString(), near_small.ShortDebugString());

  grpc::ClientContext of_small, of_large;
  const std::string area = AnswerOf(server_.query->QueryArea(&of_small, AreaRequest()));
  EXPECT_THAT(area, HasSubstr("cup"));
  EXPECT_EQ(AnswerOf(server_.query->QueryArea(&of_large, Padded(AreaRequest()))), area);
}

TEST_F(LargeRequestsTest, QuestionsWaitForTheRevisionTheyNeed) {
  std::future<std::string> area = std::async(std::launch::async, [this] {
    grpc::ClientContext context;
    return AnswerOf(server_.query->QueryArea(&context, Padded(AreaRequest(2))));
  });
  std::future<v1::QueryPointResponse> point = std::async(std::launch::async, [this] {
    v1::QueryPointResponse response;
    const grpc::Status status = Call(*server_.query, &v1::QueryService::Stub::QueryPoint,
                                     Padded(PointRequest(2)), &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  });
  Edit();
  EXPECT_EQ(point.get().revision(), 2);
  EXPECT_THAT(area.get(), HasSubstr("revision: 2"));
}

TEST_F(LargeRequestsTest, WaitingQuestionsEndWithTheirCallers) {
  for (int i = 0; i < 20; ++i) {
    grpc::ClientContext of_area, of_point;
    // Some end before they are parsed, some while they wait.
    const auto deadline = std::chrono::system_clock::now() + std::chrono::milliseconds(i);
    of_area.set_deadline(deadline);
    of_point.set_deadline(deadline);
    auto reader = server_.query->QueryArea(&of_area, Padded(AreaRequest(99)));
    v1::QueryPointResponse response;
    EXPECT_EQ(
        server_.query->QueryPoint(&of_point, Padded(PointRequest(99)), &response).error_code(),
        grpc::StatusCode::DEADLINE_EXCEEDED);
    EXPECT_TRUE(ReadAll(*reader).empty());
    EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  }
}

TEST_F(LargeRequestsTest, CallsAboutOneMapFindItsName) {
  v1::DeleteMapRequest deletion;
  deletion.set_map("site");
  v1::DeleteMapResponse deleted;
  const grpc::Status status =
      Call(*server_.catalog, &v1::CatalogService::Stub::DeleteMap, Padded(deletion), &deleted);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(deleted.map(), "site");
  EXPECT_FALSE(server_.site().Find("site").ok());

  v1::ListExplorationsRequest list;
  list.set_map("site");
  v1::ListExplorationsResponse listed;
  EXPECT_EQ(Call(*server_.exploration, &v1::ExplorationService::Stub::ListExplorations,
                 Padded(list), &listed)
                .error_code(),
            grpc::StatusCode::NOT_FOUND);
  v1::ListFrontiersRequest frontiers;
  frontiers.set_map("site");
  v1::ListFrontiersResponse found;
  EXPECT_EQ(Call(*server_.exploration, &v1::ExplorationService::Stub::ListFrontiers,
                 Padded(frontiers), &found)
                .error_code(),
            grpc::StatusCode::NOT_FOUND);
}

TEST_F(LargeRequestsTest, LayersAreMadeAndWatched) {
  grpc::ClientContext context;
  v1::WatchRequest watch;
  watch.mutable_scope()->set_map("site");
  auto watcher = server_.watch->Watch(&context, Padded(watch));
  v1::WatchResponse event;
  ASSERT_TRUE(watcher->Read(&event));

  v1::CreateLayerRequest creation;
  creation.set_map("site");
  creation.mutable_layer()->set_name("mugs");
  creation.mutable_layer()->set_kind(v1::LAYER_KIND_SEMANTIC);
  v1::CreateLayerResponse created;
  const grpc::Status status =
      Call(*server_.catalog, &v1::CatalogService::Stub::CreateLayer, Padded(creation), &created);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(created.layer().name(), "mugs");
  EXPECT_EQ(created.revision(), 2);
  EXPECT_TRUE(watcher->Read(&event));
  context.TryCancel();
  watcher->Finish();
}

TEST_F(LargeRequestsTest, ScopesWithMoreNamesThanAMapMayHaveLayersAreRefused) {
  const std::string refusal = "scope.layers has 1001 entries, and --max_layers is 1000";
  const auto expect_refused = [&](const grpc::Status& status) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(status.error_message(), HasSubstr(refusal));
  };
  const auto set_names = [](v1::Scope* scope, int num_names) {
    scope->set_map("site");
    scope->clear_layers();
    for (int i = 0; i < num_names; ++i) scope->add_layers("cups");
  };
  v1::QueryPointRequest point = PointRequest();
  v1::QueryPointResponse response;
  set_names(point.mutable_scope(), 1000);
  EXPECT_TRUE(Call(*server_.query, &v1::QueryService::Stub::QueryPoint, point, &response).ok());
  set_names(point.mutable_scope(), 1001);
  expect_refused(Call(*server_.query, &v1::QueryService::Stub::QueryPoint, point, &response));

  v1::QueryNearestRequest nearest;
  set_names(nearest.mutable_scope(), 1001);
  wire::EncodePoint({0.5, 0.5}, nearest.mutable_point());
  nearest.set_value("cup");
  nearest.set_k(1);
  v1::QueryNearestResponse neighbours;
  expect_refused(Call(*server_.query, &v1::QueryService::Stub::QueryNearest, nearest, &neighbours));

  v1::QueryAreaRequest area = AreaRequest();
  set_names(area.mutable_scope(), 1001);
  grpc::ClientContext of_area;
  auto in_area = server_.query->QueryArea(&of_area, area);
  EXPECT_TRUE(ReadAll(*in_area).empty());
  expect_refused(in_area->Finish());

  v1::WatchRequest watch;
  set_names(watch.mutable_scope(), 1001);
  grpc::ClientContext of_watch;
  auto watcher = server_.watch->Watch(&of_watch, watch);
  EXPECT_TRUE(ReadAll(*watcher).empty());
  expect_refused(watcher->Finish());

  v1::ListChangesRequest changes;
  set_names(changes.mutable_scope(), 1001);
  grpc::ClientContext of_changes;
  auto lister = server_.watch->ListChanges(&of_changes, changes);
  EXPECT_TRUE(ReadAll(*lister).empty());
  expect_refused(lister->Finish());
}

}  // namespace
}  // namespace hypermap::server
