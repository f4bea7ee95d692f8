#include "server/rpc/wanted.h"

#include <grpc/support/time.h>

namespace hypermap::server {

bool IsPastDeadline(const grpc::CallbackServerContext& context) {
  // deadline() would overflow for times that are centuries ahead, as clients without a deadline may
  // send. absl::Now() can't be used: it follows the system's clock seconds late when that is set
  // back.
  const gpr_timespec deadline = context.raw_deadline();
  return gpr_time_cmp(gpr_now(deadline.clock_type), deadline) >= 0;
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
