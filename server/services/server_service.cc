#include "server/services/server_service.h"

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "base/status/status_macros.h"
#include "map/server_list.h"
#include "server/auth/caller.h"
#include "server/rpc/unary_call.h"
#include "wire/server_list.h"

namespace hypermap::server {
namespace {

// The newest revision of a map at this server, if it has the map as the store has it.
std::optional<Revision> RevisionHere(const Site& site, const storage::Survey::Map& map) {
  const absl::StatusOr<std::shared_ptr<MapSession>> session = site.Find(map.name);
  if (!session.ok() || (*session)->incarnation() != map.incarnation) return std::nullopt;
  return (*session)->snapshot()->revision;
}

// Lists the servers, and the maps that the caller may see.
ServerList ListOf(const Site& site, const storage::Survey& survey, const Caller& caller) {
  ServerList list;
  list.answered_by = site.server_id();
  std::map<std::string, int> num_maps;  // by owner
  for (const storage::Survey::Map& map : survey.maps) {
    if (!caller.MaySee(map.name)) continue;
    ++num_maps[map.owner];
    list.maps.push_back(
        {map.name, map.owner, map.revision, RevisionHere(site, map), map.incarnation});
  }
  for (const storage::Survey::Server& server : survey.servers) {
    list.servers.push_back({server.id, server.address, num_maps[server.id], server.draining});
  }
  return list;
}

absl::Status CheckShared(const Site& site) {
  if (!site.server_id().empty()) return absl::OkStatus();
  return absl::UnimplementedError("this server shares its maps with no others (--store)");
}

}  // namespace

grpc::ServerUnaryReactor* ServerService::ListServers(grpc::CallbackServerContext* context,
                                                     const grpc::ByteBuffer* request,
                                                     grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::ListServersRequest, v1::ListServersResponse>(
      facilities_.for_calls(), context, Rpc::kListServers, {request, response});
  // It waits for the database.
  return AnswerOn(
      &facilities_.workers->long_questions, call, [this, call]() -> absl::StatusOr<int64_t> {
        HYPERMAP_RETURN_IF_ERROR(CheckShared(*facilities_.site));
        HYPERMAP_ASSIGN_OR_RETURN(const storage::Survey survey, facilities_.site->TakeSurvey());
        const ServerList list = ListOf(*facilities_.site, survey, call->context().caller());
        wire::EncodeServerList(list, call->response());
        return call->response()->maps_size();
      });
}

grpc::ServerUnaryReactor* ServerService::DrainServer(grpc::CallbackServerContext* context,
                                                     const grpc::ByteBuffer* request,
                                                     grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::DrainServerRequest, v1::DrainServerResponse>(
      facilities_.for_calls(), context, Rpc::kDrainServer, {request, response});
  // It waits for the database.
  return AnswerOn(&facilities_.workers->openings, call, [this, call]() -> absl::StatusOr<int64_t> {
    HYPERMAP_RETURN_IF_ERROR(call->context().caller().CheckAllMaps());
    HYPERMAP_RETURN_IF_ERROR(CheckShared(*facilities_.site));
    const v1::DrainServerRequest& request = call->request();
    Site& site = *facilities_.site;
    const std::string server = request.server().empty() ? site.server_id() : request.server();
    HYPERMAP_RETURN_IF_ERROR(site.SetDraining(server, !request.undo()));
    return 0;
  });
}

}  // namespace hypermap::server
