#include "server/rpc/wanted.h"

#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace hypermap::server {

absl::Status CheckWanted(const grpc::CallbackServerContext& context) {
  // The deadline comes first, because gRPC also cancels calls that are past it.
  if (absl::Now() >= absl::FromChrono(context.deadline())) {
    return absl::DeadlineExceededError("the request's deadline has passed");
  }
  if (context.IsCancelled()) return absl::CancelledError("the caller went away");
  return absl::OkStatus();
}

}  // namespace hypermap::server
