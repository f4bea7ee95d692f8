#include "ingest/frame_service/frame_server.h"

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "base/admission/budget.h"
#include "base/admission/client_host.h"
#include "base/admission/grpc_listener.h"
#include "base/admission/refusals.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/frame_service.grpc.pb.h"
#include "ingest/frame_service/frame_call.h"
#include "wire/health/health_service.h"
#include "wire/reflection/reflection_service.h"
#include "wire/status.h"

namespace hypermap::ingest {
namespace {

// The method is raw: the memory of a request is charged before it is parsed.
class FrameServiceImpl
    : public v1::FrameService::WithRawCallbackMethod_StreamFrames<v1::FrameService::Service> {
 public:
  explicit FrameServiceImpl(std::shared_ptr<FrameCalls> calls) : calls_(std::move(calls)) {}

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* StreamFrames(
      grpc::CallbackServerContext* context) override {
    return new FrameCall(calls_, context->peer());
  }

 private:
  const std::shared_ptr<FrameCalls> calls_;
};

// Admits the calls of gRPC's standard services within the memory of the server.
class StandardTicket final : public reflection::Ticket {
 public:
  StandardTicket(FrameCalls* calls, grpc::CallbackServerContext* context)
      : refusals_(&calls->refusals),
        memory_(&calls->memory, admission::HostOfPeer(context->peer())),
        admitted_(memory_.Add(kBytesOfCall)) {}

  absl::Status admitted() const override { return admitted_; }
  absl::Status ChargeMemory(int64_t bytes) override { return memory_.Add(bytes); }
  void FreeMemory(int64_t bytes) override { memory_.GiveBack(bytes); }
  grpc::Status Encode(const absl::Status& status) override {
    refusals_->Count(status);
    return wire::EncodeStatus(status);
  }

 private:
  // Estimate of the memory of gRPC and of a short request.
  static constexpr int64_t kBytesOfCall = 16 << 10;

  admission::Refusals* const refusals_;
  admission::Budget::Charge memory_;
  const absl::Status admitted_;
};

reflection::Admit AdmitBy(FrameCalls* calls) {
  return [calls](grpc::CallbackServerContext* context) {
    return std::make_unique<StandardTicket>(calls, context);
  };
}

}  // namespace

struct FrameServer::Impl {
  Impl(const FrameServerOptions& options, const client::Client& client,
       std::shared_ptr<const Observer> observer)
      : calls(std::make_shared<FrameCalls>(options, client, std::move(observer))),
        service(calls),
        health(AdmitBy(calls.get())),
        reflection({v1::FrameService::service_full_name(), health::HealthService::kName},
                   AdmitBy(calls.get())) {}

  std::shared_ptr<FrameCalls> calls;
  FrameServiceImpl service;
  health::HealthService health;
  reflection::ReflectionService reflection;
  std::unique_ptr<grpc::Server> server;
  // Destroyed before the server, to which it gives connections.
  std::optional<admission::GrpcListener> listener;
};

FrameServer::FrameServer() = default;

FrameServer::~FrameServer() { Shutdown(); }

absl::StatusOr<std::unique_ptr<FrameServer>> FrameServer::Start(
    const FrameServerOptions& options, const client::Client& client,
    std::shared_ptr<const Observer> observer) {
  std::unique_ptr<FrameServer> made(new FrameServer());
  made->impl_ = std::make_unique<Impl>(options, client, std::move(observer));
  grpc::ServerBuilder builder;
  admission::GrpcListener& listener =
      made->impl_->listener.emplace(&builder, grpc::InsecureServerCredentials());
  builder.SetMaxReceiveMessageSize(options.max_message_bytes);
  // Told to the clients in HTTP/2's settings.
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, options.max_streams);
  builder.RegisterService(&made->impl_->service);
  made->impl_->health.SetServingStatus(v1::FrameService::service_full_name(), true);
  made->impl_->health.RegisterWith(&builder);
  made->impl_->reflection.RegisterWith(&builder);
  made->impl_->server = builder.BuildAndStart();
  if (!made->impl_->server) return absl::InternalError("gRPC can't start the server");
  admission::ConnectionListenerOptions listen;
  listen.address = options.listen;
  listen.limits = options.connections;
  listen.max_resident_bytes = options.max_resident_bytes;
  listen.log = options.log;
  HYPERMAP_RETURN_IF_ERROR(listener.Start(std::move(listen)));
  made->address_ = listener.connections().address();
  return made;
}

void FrameServer::Shutdown() {
  if (!impl_ || !impl_->server) return;
  impl_->listener->Stop();
  impl_->health.Stop();
  impl_->server->Shutdown(absl::ToChronoTime(absl::Now()));
  {
    FrameCalls& calls = *impl_->calls;
    const MutexLock lock(&calls.mutex);
    while (calls.running != 0) calls.ended.Wait(&calls.mutex);
  }
  impl_->server->Wait();
  impl_->server.reset();
}

}  // namespace hypermap::ingest
