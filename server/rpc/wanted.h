// Whether anybody still waits for an answer.
#ifndef HYPERMAP_SERVER_RPC_WANTED_H_
#define HYPERMAP_SERVER_RPC_WANTED_H_

#include <grpcpp/server_context.h>

#include "absl/status/status.h"

namespace hypermap::server {

// CANCELLED when the caller went away, DEADLINE_EXCEEDED past its deadline.
absl::Status CheckWanted(const grpc::CallbackServerContext& context);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_WANTED_H_
