#include "server/services/catalog_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "server/services/testing/test_server.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CatalogServiceTest : public ::testing::Test {
 protected:
  // Calls an rpc of the service's stub.
  template <typename Request, typename Response>
  grpc::Status Call(grpc::Status (v1::CatalogService::Stub::*rpc)(grpc::ClientContext*,
                                                                  const Request&, Response*),
                    const Request& request, Response* response) {
    grpc::ClientContext context;
    return ((*server_.catalog).*rpc)(&context, request, response);
  }

  grpc::Status CreateMap(const std::string& name, const std::string& request_id = "") {
    v1::CreateMapRequest request;
    request.set_map(name);
    request.set_request_id(request_id);
    v1::CreateMapResponse response;
    return Call(&v1::CatalogService::Stub::CreateMap, request, &response);
  }

  std::vector<std::string> MapNames() {
    v1::ListMapsResponse response;
    EXPECT_TRUE(Call(&v1::CatalogService::Stub::ListMaps, v1::ListMapsRequest(), &response).ok());
    std::vector<std::string> names;
    for (const v1::Map& map : response.maps()) names.push_back(map.name());
    return names;
  }

  // Sends the messages, and ends the stream unless `break_off`.
  grpc::Status Import(const std::vector<v1::ImportMapRequest>& messages,
                      v1::ImportMapResponse* response, bool break_off = false) {
    grpc::ClientContext context;
    auto writer = server_.catalog->ImportMap(&context, response);
    for (const v1::ImportMapRequest& message : messages) writer->Write(message);
    if (break_off) context.TryCancel();
    writer->WritesDone();
    return writer->Finish();
  }

  static v1::ImportMapRequest Header(v1::FileFormat format, bool create_map = true) {
    v1::ImportMapRequest message;
    message.mutable_header()->set_map("site");
    message.mutable_header()->set_format(format);
    message.mutable_header()->set_create_map(create_map);
    message.mutable_header()->set_layer("things");
    message.mutable_header()->set_request_id("i1");
    return message;
  }

  static v1::ImportMapRequest Chunk(const std::string& name, const std::string& data) {
    v1::ImportMapRequest message;
    message.mutable_chunk()->set_file_name(name);
    message.mutable_chunk()->set_data(data);
    return message;
  }

  static Limits SmallLimits() {
    Limits limits;
    limits.max_import_bytes = 2000;
    limits.max_chunk_bytes = 16;
    return limits;
  }

  TestServer server_{SmallLimits()};
};

constexpr char kCup[] =
    R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{"label":"cup"},)"
    R"("geometry":{"type":"Polygon","coordinates":[[[0,0],[1,0],[1,1],[0,0]]]}}]})";

TEST_F(CatalogServiceTest, MapsAreMadeListedAndDeleted) {
  ASSERT_TRUE(CreateMap("office", "c1").ok());
  ASSERT_TRUE(CreateMap("lab").ok());
  EXPECT_TRUE(CreateMap("office", "c1").ok());
  EXPECT_EQ(CreateMap("office", "c2").error_code(), grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_THAT(MapNames(), ElementsAre("lab", "office"));

  v1::DeleteMapRequest deletion;
  deletion.set_map("lab");
  deletion.set_request_id("d1");
  v1::DeleteMapResponse deleted;
  EXPECT_TRUE(Call(&v1::CatalogService::Stub::DeleteMap, deletion, &deleted).ok());
  EXPECT_EQ(deleted.map(), "lab");
  EXPECT_TRUE(Call(&v1::CatalogService::Stub::DeleteMap, deletion, &deleted).ok());
  EXPECT_THAT(MapNames(), ElementsAre("office"));

  v1::GetMapRequest get;
  get.set_map("office");
  v1::GetMapResponse map;
  ASSERT_TRUE(Call(&v1::CatalogService::Stub::GetMap, get, &map).ok());
  EXPECT_EQ(map.map().frame_id(), "map");
  EXPECT_EQ(map.map().revision(), 0);
  EXPECT_GT(map.map().create_time().seconds(), 0);
  get.set_map("lab");
  EXPECT_EQ(Call(&v1::CatalogService::Stub::GetMap, get, &map).error_code(),
            grpc::StatusCode::NOT_FOUND);
}

TEST_F(CatalogServiceTest, LayersAreMadeListedAndDeleted) {
  ASSERT_TRUE(CreateMap("site").ok());
  v1::CreateLayerRequest creation;
  creation.set_map("site");
  creation.set_request_id("l1");
  creation.mutable_layer()->set_name("things");
  creation.mutable_layer()->set_kind(v1::LAYER_KIND_SEMANTIC);
  v1::CreateLayerResponse created, again;
  ASSERT_TRUE(Call(&v1::CatalogService::Stub::CreateLayer, creation, &created).ok());
  EXPECT_EQ(created.revision(), 1);
  EXPECT_EQ(created.layer().frame_id(), "map");

  v1::GetLayerRequest get;
  get.set_map("site");
  get.set_layer("things");
  v1::GetLayerResponse layer;
  ASSERT_TRUE(Call(&v1::CatalogService::Stub::GetLayer, get, &layer).ok());
  EXPECT_EQ(layer.layer().SerializeAsString(), created.layer().SerializeAsString());

  v1::DeleteLayerRequest deletion;
  deletion.set_map("site");
  deletion.set_layer("things");
  v1::DeleteLayerResponse deleted;
  ASSERT_TRUE(Call(&v1::CatalogService::Stub::DeleteLayer, deletion, &deleted).ok());
  EXPECT_EQ(deleted.revision(), 2);
  v1::ListLayersRequest list;
  list.set_map("site");
  v1::ListLayersResponse layers;
  ASSERT_TRUE(Call(&v1::CatalogService::Stub::ListLayers, list, &layers).ok());
  EXPECT_EQ(layers.revision(), 2);
  EXPECT_EQ(layers.layers_size(), 0);

  ASSERT_TRUE(Call(&v1::CatalogService::Stub::CreateLayer, creation, &again).ok());
  EXPECT_EQ(again.SerializeAsString(), created.SerializeAsString());
}

TEST_F(CatalogServiceTest, BadLayersNameTheField) {
  ASSERT_TRUE(CreateMap("site").ok());
  v1::CreateLayerRequest request;
  request.set_map("site");
  v1::CreateLayerResponse response;
  const auto create = [&] {
    return Call(&v1::CatalogService::Stub::CreateLayer, request, &response).error_message();
  };
  EXPECT_EQ(create(), "layer is missing");
  request.mutable_layer()->set_name("things");
  EXPECT_EQ(create(), "layer.kind is missing");
  request.mutable_layer()->set_kind(v1::LAYER_KIND_OCCUPANCY);
  EXPECT_THAT(create(), HasSubstr("layer.grid is required"));
  request.mutable_layer()->mutable_grid()->set_resolution_m(-1);
  EXPECT_THAT(create(), HasSubstr("layer.grid.resolution_m"));
}

TEST_F(CatalogServiceTest, TransformsAreSetAndListed) {
  ASSERT_TRUE(CreateMap("site").ok());
  v1::SetTransformRequest set;
  set.set_map("site");
  v1::SetTransformResponse response;
  EXPECT_EQ(Call(&v1::CatalogService::Stub::SetTransform, set, &response).error_message(),
            "transform is missing");
  set.mutable_transform()->set_parent_frame_id("map");
  set.mutable_transform()->set_child_frame_id("dock");
  set.mutable_transform()->mutable_parent_from_child()->set_yaw(0.5);
  ASSERT_TRUE(Call(&v1::CatalogService::Stub::SetTransform, set, &response).ok());
  EXPECT_EQ(response.revision(), 1);
  v1::ListTransformsRequest list;
  list.set_map("site");
  v1::ListTransformsResponse transforms;
  ASSERT_TRUE(Call(&v1::CatalogService::Stub::ListTransforms, list, &transforms).ok());
  EXPECT_EQ(transforms.frame_id(), "map");
  ASSERT_EQ(transforms.transforms_size(), 1);
  EXPECT_EQ(transforms.transforms(0).parent_from_child().yaw(), 0.5);
}

TEST_F(CatalogServiceTest, ImportMakesTheMapAsOneRevision) {
  v1::ImportMapResponse response;
  const std::string file = kCup;
  const grpc::Status status =
      Import({Header(v1::FILE_FORMAT_GEOJSON), Chunk("a.geojson", file.substr(0, 50)),
              Chunk("a.geojson", file.substr(50))},
             &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.revision(), 1);
  EXPECT_THAT(response.layers(), ElementsAre("things"));

  v1::ImportMapResponse again;
  ASSERT_TRUE(Import({Header(v1::FILE_FORMAT_GEOJSON), Chunk("a.geojson", file)}, &again).ok());
  EXPECT_EQ(again.SerializeAsString(), response.SerializeAsString());
  EXPECT_EQ((*server_.site().Find("site"))->snapshot()->FindLayer("things")->Size(), 1);
}

TEST_F(CatalogServiceTest, ImportThatFailsMakesNoMap) {
  const v1::ImportMapRequest header = Header(v1::FILE_FORMAT_GEOJSON);
  const v1::ImportMapRequest file = Chunk("a.geojson", kCup);
  v1::ImportMapRequest bad_layer = header;
  bad_layer.mutable_header()->set_layer("no name");
  v1::ImportMapRequest bad_map = header;
  bad_map.mutable_header()->set_map("../site");
  v1::ImportMapRequest no_format = header;
  no_format.mutable_header()->clear_format();
  const struct {
    const char* name;
    std::vector<v1::ImportMapRequest> messages;
    grpc::StatusCode code;
    const char* error;
  } cases[] = {
      {"nothing", {}, grpc::StatusCode::INVALID_ARGUMENT, "header"},
      {"no header", {file}, grpc::StatusCode::INVALID_ARGUMENT, "header"},
      {"two headers", {header, header}, grpc::StatusCode::INVALID_ARGUMENT, "header"},
      {"empty message", {header, {}}, grpc::StatusCode::INVALID_ARGUMENT, "nothing"},
      {"no file", {header}, grpc::StatusCode::INVALID_ARGUMENT, "one file"},
      {"truncated", {header, Chunk("a", "{\"type\":")}, grpc::StatusCode::INVALID_ARGUMENT, ""},
      {"folder", {header, Chunk("a/b", "x")}, grpc::StatusCode::INVALID_ARGUMENT, "folders"},
      {"torn apart",
       {header, Chunk("a", "x"), Chunk("b", "x"), Chunk("a", "x")},
       grpc::StatusCode::INVALID_ARGUMENT,
       "follow each other"},
      {"too large",
       {header, Chunk("a", std::string(1000, 'x')), Chunk("a", std::string(1001, 'x'))},
       grpc::StatusCode::RESOURCE_EXHAUSTED,
       "--max_import_bytes"},
      {"layer name", {bad_layer, file}, grpc::StatusCode::INVALID_ARGUMENT, "layer"},
      {"map name", {bad_map, file}, grpc::StatusCode::INVALID_ARGUMENT, "map"},
      {"format", {no_format, file}, grpc::StatusCode::INVALID_ARGUMENT, "format"},
      {"no such map",
       {Header(v1::FILE_FORMAT_GEOJSON, /*create_map=*/false), file},
       grpc::StatusCode::NOT_FOUND,
       "site"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    v1::ImportMapResponse response;
    const grpc::Status status = Import(c.messages, &response);
    EXPECT_EQ(status.error_code(), c.code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(c.error));
    EXPECT_THAT(MapNames(), ElementsAre());
  }
}

TEST_F(CatalogServiceTest, ImportThatIsBrokenOffMakesNoMap) {
  v1::ImportMapResponse response;
  const grpc::Status status =
      Import({Header(v1::FILE_FORMAT_GEOJSON), Chunk("a.geojson", kCup)}, &response,
             /*break_off=*/true);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::CANCELLED);
  server_.Shutdown(absl::Minutes(1));
  EXPECT_TRUE(server_.site().List().empty());
}

TEST_F(CatalogServiceTest, ImportThatCannotBeStoredMakesNoMap) {
  server_.disk().FailWrites(absl::ResourceExhaustedError("disk is full"));
  v1::ImportMapResponse response;
  const grpc::Status status =
      Import({Header(v1::FILE_FORMAT_GEOJSON), Chunk("a.geojson", kCup)}, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(MapNames(), ElementsAre());
  EXPECT_TRUE(CreateMap("site").ok());
}

TEST_F(CatalogServiceTest, ExportComesInPiecesThatMakeTheFile) {
  server_.MakeMap("site", LayerOfCups("things", 2));
  v1::ExportMapRequest request;
  request.set_map("site");
  request.set_format(v1::FILE_FORMAT_GEOJSON);
  grpc::ClientContext context;
  auto reader = server_.catalog->ExportMap(&context, request);
  const auto responses = ReadAll(*reader);
  ASSERT_TRUE(reader->Finish().ok());
  ASSERT_GT(responses.size(), 2u);
  EXPECT_EQ(responses[0].header().revision(), 1);
  std::string file;
  for (size_t i = 1; i < responses.size(); ++i) {
    EXPECT_EQ(responses[i].chunk().file_name(), "site.geojson");
    EXPECT_LE(responses[i].chunk().data().size(), 16u);
    file += responses[i].chunk().data();
  }
  EXPECT_THAT(file, HasSubstr("\"cup\""));
  EXPECT_EQ(file.front(), '{');
  EXPECT_EQ(file.substr(file.find_last_not_of(" \n"), 1), "}");
}

TEST_F(CatalogServiceTest, BadExportsNameTheField) {
  server_.MakeMap("site", LayerOfCups("things", 2));
  const auto error = [&](const v1::ExportMapRequest& request) {
    grpc::ClientContext context;
    auto reader = server_.catalog->ExportMap(&context, request);
    EXPECT_TRUE(ReadAll(*reader).empty());
    return reader->Finish();
  };
  v1::ExportMapRequest request;
  request.set_map("site");
  EXPECT_EQ(error(request).error_message(), "format is missing");
  request.set_format(v1::FILE_FORMAT_NAV2);
  EXPECT_THAT(error(request).error_message(), HasSubstr("0 occupancy layers"));
  request.set_format(v1::FILE_FORMAT_HMAP);
  request.add_layers("nowhere");
  EXPECT_EQ(error(request).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(CatalogServiceTest, BackupComesInPiecesAndLeavesNothingBehind) {
  server_.MakeMap("site", LayerOfCups("things", 2));
  v1::BackupMapRequest request;
  request.set_map("site");
  grpc::ClientContext context;
  auto reader = server_.catalog->BackupMap(&context, request);
  std::string copy;
  for (const v1::BackupMapResponse& response : ReadAll(*reader)) copy += response.data();
  ASSERT_TRUE(reader->Finish().ok());
  EXPECT_EQ(copy, "copy of site at revision 1");
  server_.Shutdown(absl::Minutes(1));
  EXPECT_THAT(server_.ScratchFiles(), ::testing::IsEmpty());
}

// The answers are refused while they are made, and not when they are complete.
TEST(CatalogLimitsTest, ListsOfLayersAreBoundedLikeMessages) {
  Limits limits;
  limits.max_message_bytes = 100'000;
  TestServer server(limits);
  EditBatch batch;
  for (const char* const name : {"a", "b", "c"}) {
    LayerSpec spec;
    spec.name = name;
    for (int i = 0; i < 40; ++i) {
      spec.aliases.insert_or_assign(absl::StrCat("alias", i), {std::string(1000, 'x')});
    }
    batch.edits.push_back(hypermap::CreateLayer{spec});
  }
  server.MakeMap("site", batch);
  grpc::ClientContext context;
  v1::ListLayersRequest request;
  request.set_map("site");
  v1::ListLayersResponse response;
  const grpc::Status status = server.catalog->ListLayers(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("--max_message_bytes"));
  grpc::ClientContext other;
  v1::GetLayerRequest asked;
  asked.set_map("site");
  asked.set_layer("b");
  v1::GetLayerResponse layer;
  EXPECT_TRUE(server.catalog->GetLayer(&other, asked, &layer).ok());
  EXPECT_EQ(layer.layer().aliases_size(), 40);
}

}  // namespace
}  // namespace hypermap::server
