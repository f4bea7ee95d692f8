// Checks whether the caller still waits for an answer.
#ifndef HYPERMAP_SERVER_RPC_WANTED_H_
#define HYPERMAP_SERVER_RPC_WANTED_H_

#include <grpcpp/server_context.h>

#include "absl/status/status.h"

namespace hypermap::server {

// CANCELLED if the caller has gone away, DEADLINE_EXCEEDED if the call's deadline has passed.
absl::Status CheckWanted(const grpc::CallbackServerContext& context);

// Returns whether the call's deadline has passed.
bool IsPastDeadline(const grpc::CallbackServerContext& context);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_WANTED_H_
