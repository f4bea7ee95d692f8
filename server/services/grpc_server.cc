#include "server/services/grpc_server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_builder.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "grpc/health/v1/health.pb.h"

namespace hypermap::server {
namespace {

// Time for watches to end by themselves, before those with slow readers are cancelled.
constexpr absl::Duration kWatchGrace = absl::Seconds(1);
constexpr absl::Duration kHealthPeriod = absl::Seconds(1);

}  // namespace

GrpcServer::GrpcServer(const Facilities& facilities)
    : catalog_(facilities),
      query_(facilities),
      edit_(facilities),
      ingest_(facilities),
      exploration_(facilities),
      watch_(facilities),
      site_(facilities.site),
      budgets_(facilities.budgets) {}

GrpcServer::~GrpcServer() = default;

absl::StatusOr<std::unique_ptr<GrpcServer>> GrpcServer::Start(const GrpcServerOptions& options,
                                                              const Facilities& facilities) {
  HYPERMAP_RETURN_IF_ERROR(tls::CheckServerFiles(options.tls));
  grpc::EnableDefaultHealthCheckService(true);
  // Reflection finds only services whose descriptors are linked in, which this reference ensures.
  grpc::health::v1::HealthCheckRequest::descriptor();
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  std::unique_ptr<GrpcServer> made(new GrpcServer(facilities));

  grpc::ServerBuilder builder;
  made->listener_ =
      std::make_unique<admission::GrpcListener>(&builder, tls::MakeServerCredentials(options.tls));
  builder.SetMaxReceiveMessageSize(options.max_message_bytes);
  builder.SetMaxSendMessageSize(options.max_message_bytes);
  // Told to the clients in HTTP/2's settings. There is no resource quota of gRPC's: in 1.51 it
  // refuses nothing, and cancels calls of any client when it is exceeded.
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, options.max_calls_per_connection);
  builder.RegisterService(&made->catalog_);
  builder.RegisterService(&made->query_);
  builder.RegisterService(&made->edit_);
  builder.RegisterService(&made->ingest_);
  builder.RegisterService(&made->exploration_);
  builder.RegisterService(&made->watch_);
  made->server_ = builder.BuildAndStart();
  if (!made->server_) return absl::InternalError("gRPC can't start the server");
  grpc::HealthCheckServiceInterface* health = made->server_->GetHealthCheckService();
  for (const char* service :
       {v1::CatalogService::service_full_name(), v1::QueryService::service_full_name(),
        v1::EditService::service_full_name(), v1::IngestService::service_full_name(),
        v1::ExplorationService::service_full_name(), v1::WatchService::service_full_name()}) {
    health->SetServingStatus(service, true);
  }
  admission::ConnectionListenerOptions listen;
  listen.address = options.listen;
  listen.limits = options.connections;
  listen.max_resident_bytes = options.max_resident_bytes;
  listen.floods = [budgets = facilities.budgets] { return budgets->cancelled_calls.TakeFloods(); };
  listen.log = [](const std::string& line) { spdlog::warn("{}", line); };
  HYPERMAP_RETURN_IF_ERROR(made->listener_->Start(std::move(listen)));
  made->TellHealth();
  return made;
}

void GrpcServer::TellHealth() {
  server_->GetHealthCheckService()->SetServingStatus(
      kAdmissionService, !budgets_->refusals.IsOverloaded(kOverloadPeriod));
  // Reading the clock notices jumps.
  site_->clock().Read();
  server_->GetHealthCheckService()->SetServingStatus(kClockService,
                                                     !site_->clock().state().jump.has_value());
  health_timer_.RunAfter(kHealthPeriod, [this] { TellHealth(); });
}

const std::string& GrpcServer::address() const { return listener_->connections().address(); }

void GrpcServer::Shutdown(absl::Duration grace) {
  listener_->Stop();
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
