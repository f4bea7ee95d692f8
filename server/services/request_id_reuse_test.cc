// Tests that an id of one request is not accepted for another.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hypermap/v1/ingest_service.grpc.pb.h"
#include "server/services/testing/test_server.h"
#include "wire/edit.h"

namespace hypermap::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr char kCup[] =
    R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{"label":"cup"},)"
    R"("geometry":{"type":"Polygon","coordinates":[[[0,0],[1,0],[1,1],[0,0]]]}}]})";
constexpr char kEmptyFile[] = R"({"type":"FeatureCollection","features":[]})";

class RequestIdReuseTest : public ::testing::Test {
 protected:
  RequestIdReuseTest() : ingest_(v1::IngestService::NewStub(server_.channel())) {
    server_.MakeMap("site", LayerOfCups("cups", 0));
  }

  // Calls an rpc of `stub` for the map "site" with a request id; `fill` sets the rest.
  template <typename Response, typename Stub, typename Request>
  static grpc::Status Call(Stub& stub,
                           grpc::Status (Stub::*rpc)(grpc::ClientContext*, const Request&,
                                                     Response*),
                           const std::string& request_id, std::function<void(Request&)> fill) {
    Request request;
    request.set_map("site");
    request.set_request_id(request_id);
    if (fill) fill(request);
    grpc::ClientContext context;
    Response response;
    return (stub.*rpc)(&context, request, &response);
  }

  grpc::Status PutCups(const std::string& request_id, int num_cups) {
    return Call<v1::ApplyEditsResponse, v1::EditService::Stub, v1::ApplyEditsRequest>(
        *server_.edit, &v1::EditService::Stub::ApplyEdits, request_id,
        [num_cups](v1::ApplyEditsRequest& request) {
          const EditBatch cups = LayerOfCups("cups", num_cups);
          for (int i = 0; i < num_cups; ++i) {
            wire::EncodeEdit(cups.edits[i + 1], request.add_edits());
          }
        });
  }

  grpc::Status CreateLayer(const std::string& request_id, const std::string& name) {
    return Call<v1::CreateLayerResponse, v1::CatalogService::Stub, v1::CreateLayerRequest>(
        *server_.catalog, &v1::CatalogService::Stub::CreateLayer, request_id,
        [&name](v1::CreateLayerRequest& request) {
          request.mutable_layer()->set_name(name);
          request.mutable_layer()->set_kind(v1::LAYER_KIND_SEMANTIC);
        });
  }

  grpc::Status DeleteLayer(const std::string& request_id) {
    return Call<v1::DeleteLayerResponse, v1::CatalogService::Stub, v1::DeleteLayerRequest>(
        *server_.catalog, &v1::CatalogService::Stub::DeleteLayer, request_id,
        [](v1::DeleteLayerRequest& request) { request.set_layer("cups"); });
  }

  grpc::Status SetTransform(const std::string& request_id, double x) {
    return Call<v1::SetTransformResponse, v1::CatalogService::Stub, v1::SetTransformRequest>(
        *server_.catalog, &v1::CatalogService::Stub::SetTransform, request_id,
        [x](v1::SetTransformRequest& request) {
          request.mutable_transform()->set_parent_frame_id("map");
          request.mutable_transform()->set_child_frame_id("dock");
          request.mutable_transform()->mutable_parent_from_child()->set_x(x);
        });
  }

  grpc::Status RebuildLayer(const std::string& request_id) {
    return Call<v1::RebuildLayerResponse, v1::IngestService::Stub, v1::RebuildLayerRequest>(
        *ingest_, &v1::IngestService::Stub::RebuildLayer, request_id,
        [](v1::RebuildLayerRequest& request) { request.set_layer("cups"); });
  }

  grpc::Status RetractSource(const std::string& request_id) {
    return Call<v1::RetractSourceResponse, v1::IngestService::Stub, v1::RetractSourceRequest>(
        *ingest_, &v1::IngestService::Stub::RetractSource, request_id,
        [](v1::RetractSourceRequest& request) {
          request.set_layer("cups");
          request.set_robot("a");
        });
  }

  grpc::Status CorrectPoses(const std::string& request_id) {
    return Call<v1::CorrectPosesResponse, v1::IngestService::Stub, v1::CorrectPosesRequest>(
        *ingest_, &v1::IngestService::Stub::CorrectPoses, request_id,
        [](v1::CorrectPosesRequest& request) {
          request.set_layer("cups");
          request.set_robot("a");
          v1::CorrectedPose& pose = *request.add_poses();
          pose.mutable_stamp();
          pose.mutable_pose();
        });
  }

  grpc::Status SmoothPoses(const std::string& request_id) {
    return Call<v1::SmoothPosesResponse, v1::IngestService::Stub, v1::SmoothPosesRequest>(
        *ingest_, &v1::IngestService::Stub::SmoothPoses, request_id,
        [](v1::SmoothPosesRequest& request) { request.set_layer("cups"); });
  }

  grpc::Status StartExploration(const std::string& request_id) {
    return Call<v1::StartExplorationResponse, v1::ExplorationService::Stub,
                v1::StartExplorationRequest>(*server_.exploration,
                                             &v1::ExplorationService::Stub::StartExploration,
                                             request_id, [](v1::StartExplorationRequest& request) {
                                               for (const double x : {0.0, 1.0, 1.0}) {
                                                 request.mutable_area()->mutable_outer()->add_xs(x);
                                               }
                                               for (const double y : {0.0, 0.0, 1.0}) {
                                                 request.mutable_area()->mutable_outer()->add_ys(y);
                                               }
                                               request.set_occupancy_layer("walls");
                                               request.set_exploration_layer("seen");
                                             });
  }

  grpc::Status CreateMap(const std::string& request_id, const std::string& map,
                         const std::string& frame) {
    return Call<v1::CreateMapResponse, v1::CatalogService::Stub, v1::CreateMapRequest>(
        *server_.catalog, &v1::CatalogService::Stub::CreateMap, request_id,
        [&](v1::CreateMapRequest& request) {
          request.set_map(map);
          request.set_frame_id(frame);
        });
  }

  grpc::Status DeleteMap(const std::string& request_id, const std::string& map) {
    return Call<v1::DeleteMapResponse, v1::CatalogService::Stub, v1::DeleteMapRequest>(
        *server_.catalog, &v1::CatalogService::Stub::DeleteMap, request_id,
        [&map](v1::DeleteMapRequest& request) { request.set_map(map); });
  }

  grpc::Status Import(const std::string& request_id, const std::string& map,
                      const std::string& content) {
    v1::ImportMapRequest header;
    header.mutable_header()->set_map(map);
    header.mutable_header()->set_format(v1::FILE_FORMAT_GEOJSON);
    header.mutable_header()->set_create_map(true);
    header.mutable_header()->set_layer("things");
    header.mutable_header()->set_request_id(request_id);
    v1::ImportMapRequest file;
    file.mutable_chunk()->set_file_name("a.geojson");
    file.mutable_chunk()->set_data(content);
    grpc::ClientContext context;
    v1::ImportMapResponse response;
    auto writer = server_.catalog->ImportMap(&context, &response);
    writer->Write(header);
    writer->Write(file);
    writer->WritesDone();
    return writer->Finish();
  }

  Revision RevisionOf(const std::string& map) {
    return (*server_.site().Find(map))->snapshot()->revision;
  }

  TestServer server_;
  std::unique_ptr<v1::IngestService::Stub> ingest_;
};

TEST_F(RequestIdReuseTest, C6AnotherRpcIsRefusedAndTheOtherRequestIsNamed) {
  ASSERT_TRUE(PutCups("r1", 1).ok());
  const struct {
    const char* rpc;
    std::function<grpc::Status()> call;
  } cases[] = {
      {"CreateLayer", [this] { return CreateLayer("r1", "more"); }},
      {"DeleteLayer", [this] { return DeleteLayer("r1"); }},
      {"SetTransform", [this] { return SetTransform("r1", 1); }},
      {"RebuildLayer", [this] { return RebuildLayer("r1"); }},
      {"RetractSource", [this] { return RetractSource("r1"); }},
      {"CorrectPoses", [this] { return CorrectPoses("r1"); }},
      {"SmoothPoses", [this] { return SmoothPoses("r1"); }},
      {"StartExploration", [this] { return StartExploration("r1"); }},
      {"ImportMap", [this] { return Import("r1", "site", kCup); }},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.rpc);
    const grpc::Status status = c.call();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), AllOf(HasSubstr("\"r1\""), HasSubstr("revision 2")));
    EXPECT_EQ(RevisionOf("site"), 2);
  }
  EXPECT_TRUE(PutCups("r1", 1).ok());
  EXPECT_EQ(RevisionOf("site"), 2);
}

TEST_F(RequestIdReuseTest, C6OtherContentIsRefused) {
  ASSERT_TRUE(PutCups("edits", 1).ok());
  EXPECT_EQ(PutCups("edits", 2).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  ASSERT_TRUE(CreateLayer("layer", "more").ok());
  EXPECT_EQ(CreateLayer("layer", "others").error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  ASSERT_TRUE(SetTransform("transform", 1).ok());
  EXPECT_EQ(SetTransform("transform", 2).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  ASSERT_TRUE(Import("import", "site", kCup).ok());
  EXPECT_EQ(Import("import", "site", kEmptyFile).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(RevisionOf("site"), 5);
  EXPECT_TRUE(CreateLayer("layer", "more").ok());
  EXPECT_TRUE(SetTransform("transform", 1).ok());
  EXPECT_EQ(RevisionOf("site"), 5);
}

TEST_F(RequestIdReuseTest, C6CreationOfAMapInAnotherFrameOrByAnImportIsNoRetry) {
  ASSERT_TRUE(CreateMap("c1", "lab", "map").ok());
  EXPECT_TRUE(CreateMap("c1", "lab", "map").ok());
  const grpc::Status other = CreateMap("c1", "lab", "odom");
  EXPECT_EQ(other.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(other.error_message(), AllOf(HasSubstr("\"c1\""), HasSubstr("frame_id \"map\"")));

  ASSERT_TRUE(Import("i1", "attic", kCup).ok());
  EXPECT_TRUE(Import("i1", "attic", kCup).ok());
  EXPECT_EQ(CreateMap("i1", "attic", "map").error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(RevisionOf("attic"), 1);
}

TEST_F(RequestIdReuseTest, C6DeletionOfAnEarlierMapIsNotTakenForOneOfThePresent) {
  ASSERT_TRUE(DeleteMap("d1", "site").ok());
  EXPECT_TRUE(DeleteMap("d1", "site").ok());
  ASSERT_TRUE(CreateMap("c1", "site", "map").ok());
  const grpc::Status status = DeleteMap("d1", "site");
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), AllOf(HasSubstr("\"d1\""), HasSubstr("not deleted")));
  EXPECT_TRUE(server_.site().Find("site").ok());
}

}  // namespace
}  // namespace hypermap::server
