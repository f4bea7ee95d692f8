// Answers on gRPC's own threads.
#ifndef HYPERMAP_SERVER_RPC_SHORT_TURN_H_
#define HYPERMAP_SERVER_RPC_SHORT_TURN_H_

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "base/cancellation/cancellation.h"

namespace hypermap::server {

// Time for which an answer may keep one of gRPC's threads. They are few and serve all connections,
// so that work which takes longer is given up and begun anew on a worker.
inline constexpr absl::Duration kShortTurn = absl::Milliseconds(2);

// Returns what the Cancellation of such work looks at: an error when the time is over.
inline Cancellation::Look EndOfShortTurn() {
  return [end = absl::Now() + kShortTurn] {
    return absl::Now() < end ? absl::OkStatus() : absl::DeadlineExceededError("takes too long");
  };
}

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_SHORT_TURN_H_
