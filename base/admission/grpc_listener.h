// Gives the connections that a ConnectionListener accepts to a gRPC server.
#ifndef HYPERMAP_BASE_ADMISSION_GRPC_LISTENER_H_
#define HYPERMAP_BASE_ADMISSION_GRPC_LISTENER_H_

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "base/admission/connection_listener.h"

namespace hypermap::admission {

// Takes the place of ServerBuilder::AddListeningPort. gRPC's own listener closes its socket for
// good when the process runs out of file descriptors (grpc/grpc#20418), and has no limit of
// connections.
class GrpcListener {
 public:
  // Prepares `builder` for connections with these credentials, and turns off the decompression of
  // messages: gRPC 1.51 decompresses a message whole before it looks at its size, and none of
  // Hypermap's clients compresses.
  GrpcListener(grpc::ServerBuilder* builder, std::shared_ptr<grpc::ServerCredentials> credentials);

  // Listens as `options` say; their member `accept` is ignored. The server must be running.
  absl::Status Start(ConnectionListenerOptions options);

  // REQUIRES: Start has returned OK.
  const ConnectionListener& connections() const { return *listener_; }
  // Accepts no more connections. To be called before the server is shut down.
  void Stop();
  // Shuts down the connections that are still open. REQUIRES: Stop was called.
  void ShutDownConnections() { listener_->ShutDownConnections(); }

 private:
  const std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
  std::unique_ptr<ConnectionListener> listener_;
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_GRPC_LISTENER_H_
