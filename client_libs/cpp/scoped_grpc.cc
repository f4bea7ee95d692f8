#include "client_libs/cpp/scoped_grpc.h"

#include <grpc/grpc.h>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "base/sync/deadline.h"

namespace hypermap::client {

ScopedGrpc::ScopedGrpc() { grpc_init(); }

ScopedGrpc::~ScopedGrpc() {
  grpc_shutdown();
  // What is left of a channel is destroyed on gRPC's threads, and the last of it ends them.
  const Deadline end(absl::Seconds(1));
  while (grpc_is_initialized() != 0 && !end.has_passed()) absl::SleepFor(absl::Milliseconds(1));
}

}  // namespace hypermap::client
