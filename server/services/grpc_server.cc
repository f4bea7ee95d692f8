#include "server/services/grpc_server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_builder.h>

#include <utility>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "grpc/health/v1/health.pb.h"

namespace hypermap::server {
namespace {

// Time for watches to end by themselves, before those with slow readers are cancelled.
constexpr absl::Duration kWatchGrace = absl::Seconds(1);

// The host of HOST:PORT, with the colon. Without a port gRPC would choose one, so this checks it.
absl::StatusOr<std::string> HostOf(const std::string& listen) {
  const size_t colon = listen.rfind(':');
  int port = -1;
  if (colon == std::string::npos || colon == 0 ||
      !absl::SimpleAtoi(absl::string_view(listen).substr(colon + 1), &port) || port < 0 ||
      port > 65535) {
    return absl::InvalidArgumentError(absl::StrCat("--listen=", listen, " is not HOST:PORT"));
  }
  return listen.substr(0, colon + 1);
}

}  // namespace

GrpcServer::GrpcServer(const Facilities& facilities)
    : catalog_(facilities),
      query_(facilities),
      edit_(facilities),
      ingest_(facilities),
      exploration_(facilities),
      watch_(facilities),
      site_(facilities.site) {}

GrpcServer::~GrpcServer() = default;

absl::StatusOr<std::unique_ptr<GrpcServer>> GrpcServer::Start(const GrpcServerOptions& options,
                                                              const Facilities& facilities) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string host, HostOf(options.listen));
  HYPERMAP_RETURN_IF_ERROR(tls::CheckServerFiles(options.tls));
  grpc::EnableDefaultHealthCheckService(true);
  // Reflection finds only services whose descriptors are linked in, which this reference ensures.
  grpc::health::v1::HealthCheckRequest::descriptor();
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  std::unique_ptr<GrpcServer> made(new GrpcServer(facilities));

  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(options.listen, tls::MakeServerCredentials(options.tls), &port);
  // Otherwise a second server could listen on the same port, and requests would go to either.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.SetMaxReceiveMessageSize(options.max_message_bytes);
  builder.SetMaxSendMessageSize(options.max_message_bytes);
  builder.RegisterService(&made->catalog_);
  builder.RegisterService(&made->query_);
  builder.RegisterService(&made->edit_);
  builder.RegisterService(&made->ingest_);
  builder.RegisterService(&made->exploration_);
  builder.RegisterService(&made->watch_);
  made->server_ = builder.BuildAndStart();
  if (!made->server_ || port == 0) {
    return absl::UnavailableError(
        absl::StrCat("cannot listen on ", options.listen, " (is the port taken?)"));
  }
  grpc::HealthCheckServiceInterface* health = made->server_->GetHealthCheckService();
  for (const char* service :
       {v1::CatalogService::service_full_name(), v1::QueryService::service_full_name(),
        v1::EditService::service_full_name(), v1::IngestService::service_full_name(),
        v1::ExplorationService::service_full_name(), v1::WatchService::service_full_name()}) {
    health->SetServingStatus(service, true);
  }
  made->address_ = absl::StrCat(host, port);
  return made;
}

void GrpcServer::Shutdown(absl::Duration grace) {
  server_->GetHealthCheckService()->Shutdown();
  // Streams that have no end of their own would hold up the shutdown for all of `grace`.
  for (const Site::Entry& map : site_->List()) {
    if (map.session) map.session->feed().Close();
  }
  query_.StopStreams();
  watch_.EndAfter(kWatchGrace);
  server_->Shutdown(absl::ToChronoTime(absl::Now() + grace));
  server_->Wait();
}

}  // namespace hypermap::server
