#include "base/admission/grpc_listener.h"

#include <utility>

#include "base/status/status_macros.h"

namespace hypermap::admission {
namespace {

// Time in which a new connection must finish its handshakes. gRPC's default is two minutes.
constexpr int kHandshakeTimeout_ms = 20'000;

}  // namespace

GrpcListener::GrpcListener(grpc::ServerBuilder* builder,
                           std::shared_ptr<grpc::ServerCredentials> credentials)
    : acceptor_(builder->experimental().AddExternalConnectionAcceptor(
          grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
          std::move(credentials))) {
  builder->SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder->SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder->AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeTimeout_ms);
}

absl::Status GrpcListener::Start(ConnectionListenerOptions options) {
  options.accept = [acceptor = acceptor_.get()](FileDescriptor socket) {
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
    connection.fd = socket.Release();
    acceptor->HandleNewConnection(&connection);
  };
  HYPERMAP_ASSIGN_OR_RETURN(listener_, ConnectionListener::Start(std::move(options)));
  return absl::OkStatus();
}

void GrpcListener::Stop() {
  if (listener_) listener_->Stop();
}

}  // namespace hypermap::admission
