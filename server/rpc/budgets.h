// What the calls of a server may hold together.
#ifndef HYPERMAP_SERVER_RPC_BUDGETS_H_
#define HYPERMAP_SERVER_RPC_BUDGETS_H_

#include "base/admission/budget.h"
#include "base/admission/cancelled_calls.h"
#include "base/admission/refusals.h"
#include "base/limits/limits.h"

namespace hypermap::server {

// Must outlive the server, its workers and its maps. Thread safe.
struct Budgets {
  explicit Budgets(const Limits& limits);

  // Calls that are under way or wait: --max_calls.
  admission::Budget calls;
  // Memory of large requests and of exports, from before they are decoded until they are answered:
  // --max_request_bytes.
  admission::Budget request_bytes;
  // Files of imports and backups on disk: --max_scratch_bytes.
  admission::Budget scratch_bytes;
  // Memory of the explorations of all maps: --max_exploration_bytes.
  admission::Budget exploration_bytes;
  // Calls that their callers have cancelled.
  admission::CancelledCalls cancelled_calls;
  // What was refused because of a limit.
  admission::Refusals refusals;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_BUDGETS_H_
