#include "server/rpc/wanted.h"

#include <chrono>

namespace hypermap::server {

bool IsPastDeadline(const grpc::CallbackServerContext& context) {
  // gRPC gives the deadline as a time of the system's clock as that is set now. absl::Now() can't
  // be compared with it: it follows the system's clock seconds late when that is set back.
  return std::chrono::system_clock::now() >= context.deadline();
}

absl::Status CheckWanted(const grpc::CallbackServerContext& context) {
  // The deadline comes first, because gRPC also cancels calls that are past it.
  if (IsPastDeadline(context)) {
    return absl::DeadlineExceededError("the request's deadline has passed");
  }
  if (context.IsCancelled()) return absl::CancelledError("the caller went away");
  return absl::OkStatus();
}

}  // namespace hypermap::server
