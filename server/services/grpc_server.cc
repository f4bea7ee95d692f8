#include "server/services/grpc_server.h"

#include <grpcpp/server_builder.h>

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"
#include "base/admission/open_streams.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "server/auth/caller.h"
#include "server/rpc/call_context.h"
#include "server/rpc/wanted.h"
#include "server/session/not_owner.h"

namespace hypermap::server {
namespace {

// Time for watches to end by themselves, before those with slow readers are cancelled.
constexpr absl::Duration kWatchGrace = absl::Seconds(1);
constexpr absl::Duration kHealthPeriod = absl::Seconds(1);
constexpr absl::Duration kAccessPeriod = absl::Seconds(1);
constexpr absl::Duration kOwnersPeriod = absl::Seconds(1);
// Also the time for which a full disk may be full while deleted maps could give way.
constexpr absl::Duration kReopenPeriod = absl::Seconds(1);
constexpr absl::Duration kTrashPeriod = absl::Seconds(10);
// While the server stops: how often it looks whether calls are under way, and the time that clients
// have after the last call to close their connections. gRPC would wait for those that stay open.
constexpr absl::Duration kIdlePeriod = absl::Milliseconds(20);
constexpr absl::Duration kGoodbye = absl::Milliseconds(500);
// A connection with more unexplained bytes than this many messages of the largest size is shut
// down: gRPC receives all of a message that is too large before it refuses it.
constexpr int64_t kUnfinishedMessages = 16;

std::vector<std::string> OwnServices() {
  return {v1::AccessService::service_full_name(), v1::CatalogService::service_full_name(),
          v1::QueryService::service_full_name(),  v1::EditService::service_full_name(),
          v1::IngestService::service_full_name(), v1::ExplorationService::service_full_name(),
          v1::RobotService::service_full_name(),  v1::ServerService::service_full_name(),
          v1::WatchService::service_full_name()};
}

std::vector<std::string> DescribedServices() {
  std::vector<std::string> services = OwnServices();
  services.emplace_back(health::HealthService::kName);
  return services;
}

// Admits the calls of gRPC's standard services like others.
class StandardTicket final : public reflection::Ticket {
 public:
  StandardTicket(const CallFacilities& call_facilities, grpc::CallbackServerContext* context,
                 Rpc rpc)
      : access_(call_facilities.access),
        grpc_context_(context),
        context_(call_facilities, context, rpc) {}

  absl::Status admitted() const override { return context_.admitted(); }
  absl::Status CheckName(absl::string_view name) const override {
    if (!absl::ConsumePrefix(&name, GrpcServer::kMapPrefix)) return absl::OkStatus();
    absl::ConsumeSuffix(&name, GrpcServer::kEditsSuffix);
    HYPERMAP_ASSIGN_OR_RETURN(const Caller caller, access_->Identify(*grpc_context_));
    return caller.CheckMap(name);
  }
  absl::Status ChargeMemory(int64_t bytes) override {
    return context_.ticket().ChargeMemory(bytes);
  }
  void FreeMemory(int64_t bytes) override { context_.ticket().FreeMemory(bytes); }
  grpc::Status Encode(const absl::Status& status) override {
    // gRPC also cancels calls whose deadline has passed.
    const bool is_late = absl::IsCancelled(status) && IsPastDeadline(*grpc_context_);
    return context_.End(is_late ? context_.CheckWanted() : status);
  }

 private:
  const AccessControl* const access_;
  const grpc::CallbackServerContext* const grpc_context_;
  CallContext context_;
};

reflection::Admit AdmitBy(const Facilities& facilities, Rpc rpc) {
  return [call_facilities = facilities.for_calls(), rpc](grpc::CallbackServerContext* context) {
    return std::make_unique<StandardTicket>(call_facilities, context, rpc);
  };
}

// Bytes that gRPC reads from a connection at once, and that it takes of a stream before it asks for
// more. By default, both grow with the speed of the link to megabytes, and small calls wait behind
// them. The window lets a client upload 5 MB/s over a link with 50 ms from end to end and back.
constexpr int kReadBytes = 64 << 10;
constexpr int kWindowBytes = 256 << 10;
constexpr int kPingPeriodMs = 5'000;

}  // namespace

GrpcServer::GrpcServer(const Facilities& facilities)
    : access_service_(facilities),
      catalog_(facilities),
      query_(facilities),
      edit_(facilities),
      ingest_(facilities),
      exploration_(facilities),
      watch_(facilities),
      robots_(facilities, watch_.shared()),
      servers_(facilities),
      health_(AdmitBy(facilities, Rpc::kHealth)),
      reflection_(DescribedServices(), AdmitBy(facilities, Rpc::kServerReflectionInfo)),
      site_(facilities.site),
      budgets_(facilities.budgets),
      access_(facilities.access),
      workers_(facilities.workers),
      forwarder_(facilities.forwarder) {}

GrpcServer::~GrpcServer() = default;

absl::StatusOr<std::unique_ptr<GrpcServer>> GrpcServer::Start(const GrpcServerOptions& options,
                                                              const Facilities& facilities) {
  HYPERMAP_RETURN_IF_ERROR(tls::CheckServerFiles(options.tls));
  std::unique_ptr<GrpcServer> made(new GrpcServer(facilities));

  grpc::ServerBuilder builder;
  made->listener_ =
      std::make_unique<admission::GrpcListener>(&builder, tls::MakeServerCredentials(options.tls));
  builder.SetMaxReceiveMessageSize(options.max_message_bytes);
  builder.SetMaxSendMessageSize(options.max_message_bytes);
  // Told to the clients in HTTP/2's settings. There is no resource quota of gRPC's: in 1.51 it
  // refuses nothing, and cancels calls of any client when it is exceeded.
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, options.max_calls_per_connection);
  // A client that has other servers to ask finds out by pings that this machine is dead. More of
  // them end its connection.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kPingPeriodMs);
  builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, kReadBytes);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, kWindowBytes);
  builder.RegisterService(&made->access_service_);
  builder.RegisterService(&made->catalog_);
  builder.RegisterService(&made->query_);
  builder.RegisterService(&made->edit_);
  builder.RegisterService(&made->ingest_);
  builder.RegisterService(&made->exploration_);
  builder.RegisterService(&made->watch_);
  builder.RegisterService(&made->robots_);
  builder.RegisterService(&made->servers_);
  made->health_.RegisterWith(&builder);
  made->reflection_.RegisterWith(&builder);
  made->server_ = builder.BuildAndStart();
  if (!made->server_) return absl::InternalError("gRPC can't start the server");
  for (const std::string& service : OwnServices()) made->health_.SetServingStatus(service, true);
  admission::ConnectionListenerOptions listen;
  listen.address = options.listen;
  listen.limits = options.connections;
  listen.max_resident_bytes = options.max_resident_bytes;
  listen.kept_bytes = [budgets = facilities.budgets] {
    return budgets->content->bytes() + budgets->feeds->bytes();
  };
  listen.floods = [budgets = facilities.budgets] { return budgets->cancelled_calls.TakeFloods(); };
  listen.take_explained = [budgets = facilities.budgets] {
    return budgets->explained_bytes.Take();
  };
  listen.open_streams = admission::CountOpenStreams;
  listen.max_unexplained_bytes = kUnfinishedMessages * options.max_message_bytes;
  listen.log = [](const std::string& line) { logging::Log(logging::Level::kWarning, line); };
  HYPERMAP_RETURN_IF_ERROR(made->listener_->Start(std::move(listen)));
  made->TellHealth();
  if (!facilities.access->is_open()) made->FollowAccess();
  if (facilities.forwarder != nullptr) made->FollowOwners();
  made->RemoveOldTrash();
  made->ReopenMaps();
  return made;
}

void GrpcServer::TellHealth() {
  health_.SetServingStatus(kAdmissionService, !budgets_->refusals.IsOverloaded(kOverloadPeriod));
  // Reading the clock notices jumps.
  site_->clock().Read();
  health_.SetServingStatus(kClockService, !site_->clock().state().jump.has_value());
  TellHealthOfMaps();
  timer_.RunAfter(kHealthPeriod, [this] { TellHealth(); });
}

void GrpcServer::TellHealthOfMaps() {
  std::set<std::string> names;
  for (const Site::Entry& map : site_->List()) {
    const MapState state = map.condition().state;
    const std::string name = absl::StrCat(kMapPrefix, map.name);
    const std::string edits = absl::StrCat(name, kEditsSuffix);
    const bool is_answered = state != MapState::kClosed;
    health_.SetServingStatus(name, is_answered);
    health_.SetServingStatus(edits, is_answered && state != MapState::kReadOnly);
    names.insert({name, edits});
  }
  for (const std::string& name : maps_with_health_) {
    if (!names.contains(name)) health_.Forget(name);
  }
  maps_with_health_ = std::move(names);
}

void GrpcServer::FollowAccess() {
  access_->Refresh();
  // Also if the identities are the same, because tokens expire.
  watch_.EndUnwanted();
  timer_.RunAfter(kAccessPeriod, [this] { FollowAccess(); });
}

void GrpcServer::FollowOwners() {
  forwarder_->EndCallsToFormerOwners([this](const std::string& map) -> std::optional<std::string> {
    const auto session = site_->Find(map);
    // One that is not open, as while it is made anew, may have any owner.
    const absl::Status status = session.ok() ? (*session)->CheckOwner() : session.status();
    if (status.ok()) return std::nullopt;
    return OwnerAddressOf(status).value_or("");
  });
  timer_.RunAfter(kOwnersPeriod, [this] { FollowOwners(); });
}

void GrpcServer::ReopenMaps() {
  // The task may run when this server is gone, but not when the site is.
  workers_->openings.Run([site = site_] { site->ReopenMaps(); });
  timer_.RunAfter(kReopenPeriod, [this] { ReopenMaps(); });
}

void GrpcServer::RemoveOldTrash() {
  // The task may run when this server is gone, but not when the site is.
  workers_->openings.Run([site = site_] {
    const absl::Status status = site->RemoveOldTrash();
    if (status.ok()) return;
    logging::Log(logging::Level::kWarning, "old deleted maps can't be removed",
                 {{"problem", status.ToString()}});
  });
  timer_.RunAfter(kTrashPeriod, [this] { RemoveOldTrash(); });
}

const std::string& GrpcServer::address() const { return listener_->connections().address(); }

void GrpcServer::Shutdown(absl::Duration grace) {
  health_.Stop();
  // Streams that have no end of their own would hold up the shutdown for all of `grace`.
  for (const Site::Entry& map : site_->List()) {
    if (map.session) map.session->EndWaiting();
  }
  query_.StopStreams();
  ingest_.StopStreams();
  reflection_.Stop();
  watch_.EndAfter(kWatchGrace);
  // Now, because it shuts down connections from which gRPC does not stop reading.
  listener_->Stop();
  CloseWhenIdle();
  server_->Shutdown(absl::ToChronoTime(absl::Now() + grace));
  server_->Wait();
}

void GrpcServer::CloseWhenIdle() {
  if (budgets_->calls.used() > 0) {
    timer_.RunAfter(kIdlePeriod, [this] { CloseWhenIdle(); });
  } else {
    timer_.RunAfter(kGoodbye, [this] { listener_->ShutDownConnections(); });
  }
}

}  // namespace hypermap::server
