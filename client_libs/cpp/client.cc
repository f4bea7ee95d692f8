#include "client_libs/cpp/client.h"

#include <cstdint>
#include <utility>

#include "absl/random/random.h"
#include "absl/strings/str_format.h"
#include "base/status/status_macros.h"
#include "client_libs/cpp/connection.h"
#include "client_libs/cpp/decode.h"
#include "wire/catalog.h"
#include "wire/edit.h"
#include "wire/geometry.h"
#include "wire/layer.h"
#include "wire/server_list.h"

namespace hypermap::client {
namespace {

// The revision in the answer to a mutation.
template <typename Response>
absl::StatusOr<Revision> RevisionOf(const absl::StatusOr<Response>& response) {
  if (!response.ok()) return response.status();
  return response->revision();
}

template <typename T>
absl::StatusOr<T> CheckAnswer(absl::StatusOr<T> decoded) {
  if (!decoded.ok()) return BadAnswer(decoded.status());
  return decoded;
}

}  // namespace

std::string NewRequestId() {
  absl::BitGen random;
  return absl::StrFormat("%016x%016x", absl::Uniform<uint64_t>(random),
                         absl::Uniform<uint64_t>(random));
}

Client::Client(const std::string& targets, const ClientOptions& options)
    : connection_(std::make_shared<Connection>(targets, options)) {}

absl::StatusOr<CallerAnswer> Client::GetCaller(const CallOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::AccessService::Stub::GetCaller, v1::GetCallerRequest(), options));
  return CheckAnswer(DecodeCaller(response));
}

absl::StatusOr<ServerList> Client::ListServers(const CallOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::ServerService::Stub::ListServers, v1::ListServersRequest(), options));
  return wire::DecodeServerList(response);
}

absl::Status Client::DrainServer(const std::string& server, bool undo, const CallOptions& options) {
  v1::DrainServerRequest request;
  request.set_server(server);
  request.set_undo(undo);
  return connection_->Call(&v1::ServerService::Stub::DrainServer, request, options).status();
}

absl::StatusOr<MapEntry> Client::CreateMap(const std::string& map, const std::string& frame_id,
                                           const CallOptions& options) {
  v1::CreateMapRequest request;
  request.set_map(map);
  request.set_frame_id(frame_id);
  request.set_request_id(RequestIdOf(options));
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::CatalogService::Stub::CreateMap, request, options));
  return wire::DecodeMapEntry(response.map());
}

absl::StatusOr<MapEntry> Client::GetMap(const std::string& map, const CallOptions& options) {
  v1::GetMapRequest request;
  request.set_map(map);
  HYPERMAP_ASSIGN_OR_RETURN(const auto response,
                            connection_->Call(&v1::CatalogService::Stub::GetMap, request, options));
  return wire::DecodeMapEntry(response.map());
}

absl::StatusOr<std::vector<MapEntry>> Client::ListMaps(const CallOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::CatalogService::Stub::ListMaps, v1::ListMapsRequest(), options));
  std::vector<MapEntry> maps;
  for (const v1::Map& map : response.maps()) maps.push_back(wire::DecodeMapEntry(map));
  return maps;
}

absl::Status Client::DeleteMap(const std::string& map, const CallOptions& options) {
  v1::DeleteMapRequest request;
  request.set_map(map);
  request.set_request_id(RequestIdOf(options));
  request.set_incarnation(options.incarnation);
  return connection_->Call(&v1::CatalogService::Stub::DeleteMap, request, options).status();
}

absl::StatusOr<Revision> Client::CreateLayer(const std::string& map, const LayerSpec& layer,
                                             const CallOptions& options) {
  v1::CreateLayerRequest request;
  request.set_map(map);
  wire::EncodeLayerSpec(layer, request.mutable_layer());
  request.set_request_id(RequestIdOf(options));
  request.set_incarnation(options.incarnation);
  return RevisionOf(connection_->Call(&v1::CatalogService::Stub::CreateLayer, request, options));
}

absl::StatusOr<LayerEntry> Client::GetLayer(const std::string& map, const std::string& layer,
                                            const CallOptions& options) {
  v1::GetLayerRequest request;
  request.set_map(map);
  request.set_layer(layer);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::CatalogService::Stub::GetLayer, request, options));
  return CheckAnswer(DecodeLayerEntry(response.layer()));
}

absl::StatusOr<LayerList> Client::ListLayers(const std::string& map, const CallOptions& options) {
  v1::ListLayersRequest request;
  request.set_map(map);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::CatalogService::Stub::ListLayers, request, options));
  return CheckAnswer(DecodeLayerList(response));
}

absl::StatusOr<Revision> Client::DeleteLayer(const std::string& map, const std::string& layer,
                                             const CallOptions& options) {
  v1::DeleteLayerRequest request;
  request.set_map(map);
  request.set_layer(layer);
  request.set_request_id(RequestIdOf(options));
  request.set_incarnation(options.incarnation);
  return RevisionOf(connection_->Call(&v1::CatalogService::Stub::DeleteLayer, request, options));
}

absl::StatusOr<Revision> Client::SetTransform(const std::string& map,
                                              const FrameTransform& transform,
                                              const CallOptions& options) {
  v1::SetTransformRequest request;
  request.set_map(map);
  wire::EncodeTransform(transform, request.mutable_transform());
  request.set_request_id(RequestIdOf(options));
  request.set_incarnation(options.incarnation);
  return RevisionOf(connection_->Call(&v1::CatalogService::Stub::SetTransform, request, options));
}

absl::StatusOr<TransformList> Client::ListTransforms(const std::string& map,
                                                     const CallOptions& options) {
  v1::ListTransformsRequest request;
  request.set_map(map);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::CatalogService::Stub::ListTransforms, request, options));
  return CheckAnswer(DecodeTransformList(response));
}

absl::StatusOr<EditAnswer> Client::ApplyEdits(const std::string& map, const EditBatch& batch,
                                              const CallOptions& options) {
  v1::ApplyEditsRequest request;
  request.set_map(map);
  request.set_request_id(RequestIdOf(options));
  request.set_incarnation(options.incarnation);
  wire::EncodeLayerVersions(batch.if_layers, request.mutable_if_layers());
  for (const Edit& edit : batch.edits) wire::EncodeEdit(edit, request.add_edits());
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response, connection_->Call(&v1::EditService::Stub::ApplyEdits, request, options));
  return EditAnswer{response.map(),
                    response.revision(),
                    {response.object_ids().begin(), response.object_ids().end()},
                    response.incarnation()};
}

}  // namespace hypermap::client
