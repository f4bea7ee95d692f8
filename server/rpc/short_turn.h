// Answers on gRPC's own threads.
#ifndef HYPERMAP_SERVER_RPC_SHORT_TURN_H_
#define HYPERMAP_SERVER_RPC_SHORT_TURN_H_

#include <utility>

#include "absl/time/time.h"
#include "base/cancellation/cancellation.h"

namespace hypermap::server {

// Processor time that an answer may take on one of gRPC's threads. They are few and serve all
// connections, so that work which takes longer is given up and begun anew on a worker.
inline constexpr absl::Duration kShortTurn = absl::Milliseconds(2);

// Gives such work up. Most of it ends before the first look.
class ShortTurn : public Cancellation {
 public:
  explicit ShortTurn(Look look = EndOfThreadTime(kShortTurn))
      : Cancellation(std::move(look), kInterval, FirstLook::kAfterInterval) {}
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_SHORT_TURN_H_
