#include "client_libs/testing/scripted_server.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "hypermap/v1/access_service.grpc.pb.h"
#include "hypermap/v1/catalog_service.grpc.pb.h"
#include "hypermap/v1/edit_service.grpc.pb.h"
#include "hypermap/v1/exploration_service.grpc.pb.h"
#include "hypermap/v1/query_service.grpc.pb.h"
#include "hypermap/v1/robot_service.grpc.pb.h"
#include "hypermap/v1/server_service.grpc.pb.h"
#include "hypermap/v1/watch_service.grpc.pb.h"

namespace hypermap::client {
namespace {

const grpc::Status kOutage(grpc::StatusCode::UNAVAILABLE, "outage");

template <typename Message>
std::string TakeRequestId(Message& message) {
  if constexpr (requires { message.clear_request_id(); }) {
    std::string id = message.request_id();
    message.clear_request_id();
    return id;
  }
  return "";
}

}  // namespace

template <typename Request>
bool ScriptedServer::Note(const char* rpc, Request request) {
  const MutexLock lock(&mutex_);
  if (std::string id = TakeRequestId(request); !id.empty()) request_ids_.push_back(std::move(id));
  std::string content = request.ShortDebugString();
  requests_.push_back(content.empty() ? rpc : absl::StrCat(rpc, " ", content));
  return static_cast<int>(requests_.size()) <= script_.outage;
}

template <typename Message>
grpc::Status ScriptedServer::WriteParts(grpc::ServerContext* context,
                                        grpc::ServerWriter<Message>* writer) {
  Message message;
  message.set_revision(script_.revision);
  if (script_.parts.empty() && script_.status.ok()) writer->Write(message);
  do {
    for (const v1::LayerPart& part : script_.parts) {
      *message.mutable_part() = part;
      writer->Write(message);
    }
  } while (script_.endless && !context->IsCancelled());
  if (script_.endless) cancelled_.Notify();
  return script_.status;
}

class ScriptedServer::Access : public v1::AccessService::Service {
 public:
  explicit Access(ScriptedServer& server) : server_(server) {}

  grpc::Status GetCaller(grpc::ServerContext*, const v1::GetCallerRequest* request,
                         v1::GetCallerResponse* response) override {
    if (server_.Note("GetCaller", *request)) return kOutage;
    *response = server_.script_.caller;
    return server_.script_.status;
  }

 private:
  ScriptedServer& server_;
};

class ScriptedServer::Catalog : public v1::CatalogService::Service {
 public:
  explicit Catalog(ScriptedServer& server) : server_(server) {}

  grpc::Status CreateMap(grpc::ServerContext*, const v1::CreateMapRequest* request,
                         v1::CreateMapResponse* response) override {
    if (server_.Note("CreateMap", *request)) return kOutage;
    response->mutable_map()->set_name(request->map());
    return server_.script_.status;
  }
  grpc::Status GetMap(grpc::ServerContext*, const v1::GetMapRequest* request,
                      v1::GetMapResponse* response) override {
    if (server_.Note("GetMap", *request)) return kOutage;
    response->mutable_map()->set_name(request->map());
    return server_.script_.status;
  }
  grpc::Status ListMaps(grpc::ServerContext*, const v1::ListMapsRequest* request,
                        v1::ListMapsResponse* response) override {
    if (server_.Note("ListMaps", *request)) return kOutage;
    *response = server_.script_.maps;
    return server_.script_.status;
  }
  grpc::Status DeleteMap(grpc::ServerContext*, const v1::DeleteMapRequest* request,
                         v1::DeleteMapResponse*) override {
    if (server_.Note("DeleteMap", *request)) return kOutage;
    return server_.script_.status;
  }
  grpc::Status CreateLayer(grpc::ServerContext*, const v1::CreateLayerRequest* request,
                           v1::CreateLayerResponse* response) override {
    if (server_.Note("CreateLayer", *request)) return kOutage;
    response->set_revision(server_.script_.revision);
    return server_.script_.status;
  }
  grpc::Status GetLayer(grpc::ServerContext*, const v1::GetLayerRequest* request,
                        v1::GetLayerResponse* response) override {
    if (server_.Note("GetLayer", *request)) return kOutage;
    for (const v1::Layer& layer : server_.script_.layers.layers()) {
      if (layer.name() == request->layer()) *response->mutable_layer() = layer;
    }
    return server_.script_.status;
  }
  grpc::Status ListLayers(grpc::ServerContext*, const v1::ListLayersRequest* request,
                          v1::ListLayersResponse* response) override {
    if (server_.Note("ListLayers", *request)) return kOutage;
    *response = server_.script_.layers;
    return server_.script_.status;
  }
  grpc::Status DeleteLayer(grpc::ServerContext*, const v1::DeleteLayerRequest* request,
                           v1::DeleteLayerResponse* response) override {
    if (server_.Note("DeleteLayer", *request)) return kOutage;
    response->set_revision(server_.script_.revision);
    return server_.script_.status;
  }
  grpc::Status SetTransform(grpc::ServerContext*, const v1::SetTransformRequest* request,
                            v1::SetTransformResponse* response) override {
    if (server_.Note("SetTransform", *request)) return kOutage;
    response->set_revision(server_.script_.revision);
    return server_.script_.status;
  }
  grpc::Status ListTransforms(grpc::ServerContext*, const v1::ListTransformsRequest* request,
                              v1::ListTransformsResponse* response) override {
    if (server_.Note("ListTransforms", *request)) return kOutage;
    *response = server_.script_.transforms;
    return server_.script_.status;
  }

  grpc::Status ImportMap(grpc::ServerContext*, grpc::ServerReader<v1::ImportMapRequest>* reader,
                         v1::ImportMapResponse* response) override {
    bool out = false;
    v1::ImportMapRequest message;
    v1::FileChunk file;
    const auto end_file = [&] {
      if (file.file_name().empty()) return;
      const MutexLock lock(&server_.mutex_);
      server_.requests_.push_back(
          absl::StrCat("file ", file.file_name(), " (", file.data().size(), " bytes)"));
      server_.imported_data_ = file.data();
    };
    while (reader->Read(&message)) {
      if (message.has_header()) out = server_.Note("ImportMap", message.header());
      if (!message.has_chunk()) continue;
      if (message.chunk().file_name() != file.file_name()) {
        end_file();
        file = message.chunk();
      } else {
        file.mutable_data()->append(message.chunk().data());
      }
    }
    if (out) return kOutage;
    end_file();
    *response = server_.script_.import;
    return server_.script_.status;
  }

  grpc::Status ExportMap(grpc::ServerContext*, const v1::ExportMapRequest* request,
                         grpc::ServerWriter<v1::ExportMapResponse>* writer) override {
    if (server_.Note("ExportMap", *request)) return kOutage;
    for (const v1::ExportMapResponse& part : server_.script_.export_parts) writer->Write(part);
    return server_.script_.status;
  }

  grpc::Status BackupMap(grpc::ServerContext*, const v1::BackupMapRequest* request,
                         grpc::ServerWriter<v1::BackupMapResponse>* writer) override {
    if (server_.Note("BackupMap", *request)) return kOutage;
    for (const std::string& piece : server_.script_.backup_pieces) {
      v1::BackupMapResponse message;
      message.set_data(piece);
      writer->Write(message);
    }
    return server_.script_.status;
  }

  grpc::Status CheckMap(grpc::ServerContext*, const v1::CheckMapRequest* request,
                        v1::CheckMapResponse* response) override {
    if (server_.Note("CheckMap", *request)) return kOutage;
    *response = server_.script_.check;
    return server_.script_.status;
  }

  grpc::Status DigestMap(grpc::ServerContext*, const v1::DigestMapRequest* request,
                         v1::DigestMapResponse* response) override {
    if (server_.Note("DigestMap", *request)) return kOutage;
    *response = server_.script_.digest;
    return server_.script_.status;
  }

  grpc::Status RestoreMap(grpc::ServerContext*, grpc::ServerReader<v1::RestoreMapRequest>* reader,
                          v1::RestoreMapResponse* response) override {
    bool out = false;
    v1::RestoreMapRequest message;
    std::string data;
    while (reader->Read(&message)) {
      data += message.data();
      if (!message.has_header()) continue;
      out = server_.Note("RestoreMap", message.header());
      response->mutable_map()->set_name(message.header().map());
    }
    if (out) return kOutage;
    const MutexLock lock(&server_.mutex_);
    server_.imported_data_ = data;
    return server_.script_.status;
  }

 private:
  ScriptedServer& server_;
};

class ScriptedServer::Query : public v1::QueryService::Service {
 public:
  explicit Query(ScriptedServer& server) : server_(server) {}

  grpc::Status QueryPoint(grpc::ServerContext*, const v1::QueryPointRequest* request,
                          v1::QueryPointResponse* response) override {
    if (server_.Note("QueryPoint", *request)) return kOutage;
    *response = server_.script_.point;
    return server_.script_.status;
  }
  grpc::Status QueryArea(grpc::ServerContext* context, const v1::QueryAreaRequest* request,
                         grpc::ServerWriter<v1::QueryAreaResponse>* writer) override {
    if (server_.Note("QueryArea", *request)) return kOutage;
    return server_.WriteParts(context, writer);
  }
  grpc::Status QueryValue(grpc::ServerContext* context, const v1::QueryValueRequest* request,
                          grpc::ServerWriter<v1::QueryValueResponse>* writer) override {
    if (server_.Note("QueryValue", *request)) return kOutage;
    return server_.WriteParts(context, writer);
  }
  grpc::Status QueryNearest(grpc::ServerContext*, const v1::QueryNearestRequest* request,
                            v1::QueryNearestResponse* response) override {
    if (server_.Note("QueryNearest", *request)) return kOutage;
    *response = server_.script_.nearest;
    return server_.script_.status;
  }
  grpc::Status EstimateTransform(grpc::ServerContext*, const v1::EstimateTransformRequest* request,
                                 v1::EstimateTransformResponse* response) override {
    if (server_.Note("EstimateTransform", *request)) return kOutage;
    *response = server_.script_.transform;
    return server_.script_.status;
  }
  grpc::Status QueryPoints(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<v1::QueryPointsResponse, v1::QueryPointsRequest>* stream) override {
    size_t num_answered = 0;
    for (v1::QueryPointsRequest request; stream->Read(&request);) {
      if (server_.Note("QueryPoints", request)) return kOutage;
      if (request.xs().empty()) continue;
      if (num_answered == server_.script_.points.size()) break;
      stream->Write(server_.script_.points[num_answered++]);
    }
    return server_.script_.status;
  }

 private:
  ScriptedServer& server_;
};

class ScriptedServer::Edit : public v1::EditService::Service {
 public:
  explicit Edit(ScriptedServer& server) : server_(server) {}

  grpc::Status ApplyEdits(grpc::ServerContext*, const v1::ApplyEditsRequest* request,
                          v1::ApplyEditsResponse* response) override {
    if (server_.Note("ApplyEdits", *request)) return kOutage;
    *response = server_.script_.edits;
    return server_.script_.status;
  }

 private:
  ScriptedServer& server_;
};

class ScriptedServer::Watching : public v1::WatchService::Service {
 public:
  explicit Watching(ScriptedServer& server) : server_(server) {}

  grpc::Status Watch(grpc::ServerContext* context, const v1::WatchRequest* request,
                     grpc::ServerWriter<v1::WatchResponse>* writer) override {
    if (server_.Note("Watch", *request)) return kOutage;
    ScriptedWatch watch;
    {
      const MutexLock lock(&server_.mutex_);
      const auto& watches = server_.script_.watches;
      if (server_.num_watches_ < watches.size()) watch = watches[server_.num_watches_++];
    }
    return Answer(watch, context, writer);
  }
  grpc::Status Replicate(grpc::ServerContext* context, const v1::ReplicateRequest* request,
                         grpc::ServerWriter<v1::ReplicateResponse>* writer) override {
    if (server_.Note("Replicate", *request)) return kOutage;
    ScriptedReplication replication;
    {
      const MutexLock lock(&server_.mutex_);
      const auto& replications = server_.script_.replications;
      if (server_.num_replications_ < replications.size()) {
        replication = replications[server_.num_replications_++];
      }
    }
    return Answer(replication, context, writer);
  }
  grpc::Status ListChanges(grpc::ServerContext*, const v1::ListChangesRequest* request,
                           grpc::ServerWriter<v1::ListChangesResponse>* writer) override {
    if (server_.Note("ListChanges", *request)) return kOutage;
    for (const v1::ListChangesResponse& part : server_.script_.changes) writer->Write(part);
    return server_.script_.status;
  }
  grpc::Status ListRevisions(grpc::ServerContext*, const v1::ListRevisionsRequest* request,
                             v1::ListRevisionsResponse* response) override {
    if (server_.Note("ListRevisions", *request)) return kOutage;
    *response = server_.script_.revisions;
    return server_.script_.status;
  }

 private:
  template <typename Response>
  grpc::Status Answer(const ScriptedStream<Response>& stream, grpc::ServerContext* context,
                      grpc::ServerWriter<Response>* writer) {
    for (const Response& response : stream.responses) writer->Write(response);
    while (stream.stays && !context->IsCancelled()) absl::SleepFor(absl::Milliseconds(1));
    if (stream.stays) server_.cancelled_.Notify();
    return stream.status;
  }

  ScriptedServer& server_;
};

class ScriptedServer::Exploring : public v1::ExplorationService::Service {
 public:
  explicit Exploring(ScriptedServer& server) : server_(server) {}

  grpc::Status StartExploration(grpc::ServerContext*, const v1::StartExplorationRequest* request,
                                v1::StartExplorationResponse* response) override {
    if (server_.Note("StartExploration", *request)) return kOutage;
    *response = server_.script_.started;
    return server_.script_.status;
  }
  grpc::Status GetExploration(grpc::ServerContext*, const v1::GetExplorationRequest* request,
                              v1::GetExplorationResponse* response) override {
    if (server_.Note("GetExploration", *request)) return kOutage;
    *response = server_.script_.exploration;
    return server_.script_.status;
  }
  grpc::Status ListExplorations(grpc::ServerContext*, const v1::ListExplorationsRequest* request,
                                v1::ListExplorationsResponse* response) override {
    if (server_.Note("ListExplorations", *request)) return kOutage;
    *response = server_.script_.explorations;
    return server_.script_.status;
  }
  grpc::Status ListFrontiers(grpc::ServerContext*, const v1::ListFrontiersRequest* request,
                             v1::ListFrontiersResponse* response) override {
    if (server_.Note("ListFrontiers", *request)) return kOutage;
    *response = server_.script_.frontiers;
    return server_.script_.status;
  }
  grpc::Status ClaimGoal(grpc::ServerContext*, const v1::ClaimGoalRequest* request,
                         v1::ClaimGoalResponse* response) override {
    if (server_.Note("ClaimGoal", *request)) return kOutage;
    *response = server_.script_.claimed;
    return server_.script_.status;
  }
  grpc::Status RenewGoal(grpc::ServerContext*, const v1::RenewGoalRequest* request,
                         v1::RenewGoalResponse* response) override {
    if (server_.Note("RenewGoal", *request)) return kOutage;
    *response = server_.script_.renewed;
    return server_.script_.status;
  }
  grpc::Status ReleaseGoal(grpc::ServerContext*, const v1::ReleaseGoalRequest* request,
                           v1::ReleaseGoalResponse* response) override {
    if (server_.Note("ReleaseGoal", *request)) return kOutage;
    response->set_revision(server_.script_.revision);
    return server_.script_.status;
  }
  grpc::Status StopExploration(grpc::ServerContext*, const v1::StopExplorationRequest* request,
                               v1::StopExplorationResponse* response) override {
    if (server_.Note("StopExploration", *request)) return kOutage;
    *response = server_.script_.stopped;
    return server_.script_.status;
  }

 private:
  ScriptedServer& server_;
};

class ScriptedServer::Robots : public v1::RobotService::Service {
 public:
  explicit Robots(ScriptedServer& server) : server_(server) {}

  grpc::Status Report(grpc::ServerContext*, const v1::ReportRequest* request,
                      v1::ReportResponse* response) override {
    if (server_.Note("Report", *request)) return kOutage;
    *response = server_.script_.reported;
    return server_.script_.status;
  }
  grpc::Status ListRobots(grpc::ServerContext*, const v1::ListRobotsRequest* request,
                          v1::ListRobotsResponse* response) override {
    if (server_.Note("ListRobots", *request)) return kOutage;
    *response = server_.script_.robots;
    return server_.script_.status;
  }
  grpc::Status WatchRobots(grpc::ServerContext*, const v1::WatchRobotsRequest* request,
                           grpc::ServerWriter<v1::WatchRobotsResponse>* writer) override {
    if (server_.Note("WatchRobots", *request)) return kOutage;
    const ScriptedStream<v1::WatchRobotsResponse>& stream = server_.script_.watched_robots;
    for (const v1::WatchRobotsResponse& response : stream.responses) writer->Write(response);
    return stream.status;
  }

 private:
  ScriptedServer& server_;
};

class ScriptedServer::Sharing : public v1::ServerService::Service {
 public:
  explicit Sharing(ScriptedServer& server) : server_(server) {}

  grpc::Status ListServers(grpc::ServerContext*, const v1::ListServersRequest* request,
                           v1::ListServersResponse* response) override {
    if (server_.Note("ListServers", *request)) return kOutage;
    *response = server_.script_.servers;
    return server_.script_.status;
  }
  grpc::Status DrainServer(grpc::ServerContext*, const v1::DrainServerRequest* request,
                           v1::DrainServerResponse*) override {
    if (server_.Note("DrainServer", *request)) return kOutage;
    return server_.script_.status;
  }

 private:
  ScriptedServer& server_;
};

ScriptedServer::ScriptedServer(Script script)
    : script_(std::move(script)),
      access_(std::make_unique<Access>(*this)),
      catalog_(std::make_unique<Catalog>(*this)),
      query_(std::make_unique<Query>(*this)),
      edit_(std::make_unique<Edit>(*this)),
      watching_(std::make_unique<Watching>(*this)),
      exploring_(std::make_unique<Exploring>(*this)),
      robots_(std::make_unique<Robots>(*this)),
      sharing_(std::make_unique<Sharing>(*this)) {
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(access_.get());
  builder.RegisterService(catalog_.get());
  builder.RegisterService(query_.get());
  builder.RegisterService(edit_.get());
  builder.RegisterService(watching_.get());
  builder.RegisterService(exploring_.get());
  builder.RegisterService(robots_.get());
  builder.RegisterService(sharing_.get());
  server_ = builder.BuildAndStart();
  address_ = absl::StrCat("127.0.0.1:", port);
}

ScriptedServer::~ScriptedServer() { server_->Shutdown(); }

std::vector<std::string> ScriptedServer::Requests() const {
  const MutexLock lock(&mutex_);
  return requests_;
}

std::vector<std::string> ScriptedServer::RequestIds() const {
  const MutexLock lock(&mutex_);
  return request_ids_;
}

std::string ScriptedServer::ImportedData() const {
  const MutexLock lock(&mutex_);
  return imported_data_;
}

}  // namespace hypermap::client
