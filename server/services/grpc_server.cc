#include "server/services/grpc_server.h"

#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_builder.h>
#include <spdlog/spdlog.h>

#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "grpc/health/v1/health.pb.h"
#include "server/rpc/call_ticket.h"
#include "server/rpc/request_log.h"
#include "server/rpc/wanted.h"

namespace hypermap::server {
namespace {

// Time for watches to end by themselves, before those with slow readers are cancelled.
constexpr absl::Duration kWatchGrace = absl::Seconds(1);
constexpr absl::Duration kHealthPeriod = absl::Seconds(1);
constexpr char kHealthService[] = "grpc.health.v1.Health";

std::vector<std::string> OwnServices() {
  return {v1::CatalogService::service_full_name(),     v1::QueryService::service_full_name(),
          v1::EditService::service_full_name(),        v1::IngestService::service_full_name(),
          v1::ExplorationService::service_full_name(), v1::WatchService::service_full_name()};
}

std::vector<std::string> DescribedServices() {
  std::vector<std::string> services = OwnServices();
  services.emplace_back(kHealthService);
  return services;
}

// Admits reflection streams like other calls.
class ReflectionTicket final : public reflection::Ticket {
 public:
  ReflectionTicket(Budgets* budgets, grpc::CallbackServerContext* context)
      : context_(context), ticket_(budgets, context), log_(*context, "ServerReflectionInfo", "") {}

  absl::Status admitted() const override { return ticket_.admitted(); }
  absl::Status ChargeMemory(int64_t bytes) override { return ticket_.ChargeMemory(bytes); }
  void FreeMemory(int64_t bytes) override { ticket_.FreeMemory(bytes); }
  grpc::Status Encode(const absl::Status& status) override {
    // gRPC also cancels calls whose deadline has passed.
    const absl::Status end =
        absl::IsCancelled(status) && IsPastDeadline(*context_) ? CheckWanted(*context_) : status;
    log_.Finished(end, 0);
    return ticket_.Encode(end);
  }

 private:
  const grpc::CallbackServerContext* const context_;
  CallTicket ticket_;
  const RequestLog log_;
};

}  // namespace

GrpcServer::GrpcServer(const Facilities& facilities)
    : catalog_(facilities),
      query_(facilities),
      edit_(facilities),
      ingest_(facilities),
      exploration_(facilities),
      watch_(facilities),
      reflection_(DescribedServices(),
                  [budgets = facilities.budgets](grpc::CallbackServerContext* context) {
                    return std::make_unique<ReflectionTicket>(budgets, context);
                  }),
      site_(facilities.site),
      budgets_(facilities.budgets) {}

GrpcServer::~GrpcServer() = default;

absl::StatusOr<std::unique_ptr<GrpcServer>> GrpcServer::Start(const GrpcServerOptions& options,
                                                              const Facilities& facilities) {
  HYPERMAP_RETURN_IF_ERROR(tls::CheckServerFiles(options.tls));
  grpc::EnableDefaultHealthCheckService(true);
  // Reflection finds only services whose descriptors are linked in, which this reference ensures.
  grpc::health::v1::HealthCheckRequest::descriptor();
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
  made->reflection_.RegisterWith(&builder);
  made->server_ = builder.BuildAndStart();
  if (!made->server_) return absl::InternalError("gRPC can't start the server");
  grpc::HealthCheckServiceInterface* health = made->server_->GetHealthCheckService();
  for (const std::string& service : OwnServices()) health->SetServingStatus(service, true);
  admission::ConnectionListenerOptions listen;
  listen.address = options.listen;
  listen.limits = options.connections;
  listen.max_resident_bytes = options.max_resident_bytes;
  listen.kept_bytes = [budgets = facilities.budgets] {
    return budgets->content->bytes() + budgets->feeds->bytes();
  };
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
  reflection_.Stop();
  watch_.EndAfter(kWatchGrace);
  server_->Shutdown(absl::ToChronoTime(absl::Now() + grace));
  server_->Wait();
}

}  // namespace hypermap::server
