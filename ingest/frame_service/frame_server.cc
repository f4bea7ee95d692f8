#include "ingest/frame_service/frame_server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "base/admission/grpc_listener.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/frame_service.grpc.pb.h"
#include "ingest/frame_service/frame_call.h"

namespace hypermap::ingest {
namespace {

class FrameServiceImpl : public v1::FrameService::CallbackService {
 public:
  explicit FrameServiceImpl(std::shared_ptr<FrameCalls> calls) : calls_(std::move(calls)) {}

  grpc::ServerBidiReactor<v1::StreamFramesRequest, v1::StreamFramesResponse>* StreamFrames(
      grpc::CallbackServerContext* context) override {
    return new FrameCall(calls_, context->peer());
  }

 private:
  const std::shared_ptr<FrameCalls> calls_;
};

}  // namespace

struct FrameServer::Impl {
  Impl(const FrameServerOptions& options, const client::Client& client,
       std::shared_ptr<const Observer> observer)
      : calls(new FrameCalls{
            options, client, std::move(observer), {"memory_limit", options.memory_limit}, {}, {}}),
        service(calls) {}

  std::shared_ptr<FrameCalls> calls;
  FrameServiceImpl service;
  std::unique_ptr<grpc::Server> server;
  // Destroyed before the server, to which it gives connections.
  std::optional<admission::GrpcListener> listener;
};

FrameServer::FrameServer() = default;

FrameServer::~FrameServer() { Shutdown(); }

absl::StatusOr<std::unique_ptr<FrameServer>> FrameServer::Start(
    const FrameServerOptions& options, const client::Client& client,
    std::shared_ptr<const Observer> observer) {
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  std::unique_ptr<FrameServer> made(new FrameServer());
  made->impl_ = std::make_unique<Impl>(options, client, std::move(observer));
  grpc::ServerBuilder builder;
  admission::GrpcListener& listener =
      made->impl_->listener.emplace(&builder, grpc::InsecureServerCredentials());
  builder.SetMaxReceiveMessageSize(options.max_message_bytes);
  builder.RegisterService(&made->impl_->service);
  made->impl_->server = builder.BuildAndStart();
  if (!made->impl_->server) return absl::InternalError("gRPC can't start the server");
  made->impl_->server->GetHealthCheckService()->SetServingStatus(
      v1::FrameService::service_full_name(), true);
  admission::ConnectionListenerOptions listen;
  listen.address = options.listen;
  listen.limits = options.connections;
  listen.max_resident_bytes = options.memory_limit;
  HYPERMAP_RETURN_IF_ERROR(listener.Start(std::move(listen)));
  made->address_ = listener.connections().address();
  return made;
}

void FrameServer::Shutdown() {
  if (!impl_ || !impl_->server) return;
  impl_->listener->Stop();
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
