// The budgets of a server: what all of its calls may hold together.
#ifndef HYPERMAP_SERVER_RPC_BUDGETS_H_
#define HYPERMAP_SERVER_RPC_BUDGETS_H_

#include <cstdint>
#include <memory>

#include "base/admission/budget.h"
#include "base/admission/call_rate.h"
#include "base/admission/cancelled_calls.h"
#include "base/admission/content_budget.h"
#include "base/admission/explained_bytes.h"
#include "base/admission/refusals.h"
#include "base/limits/limits.h"
#include "server/rpc/log_pace.h"
#include "server/session/feed_memory.h"

namespace hypermap::server {

// Must outlive the server, its workers and its maps. Thread safe.
struct Budgets {
  explicit Budgets(const Limits& limits);

  // Calls that are under way or wait: --max_calls.
  admission::Budget calls;
  // Calls that each client begins: --max_calls_per_second.
  admission::CallRate call_rate;
  // Memory of large requests and answers, of imports and exports, of what calls read of past
  // revisions, and of the filters of watches: --max_request_bytes.
  admission::Budget request_bytes;
  // The most memory that one request may take; one that needs more is refused. The largest message
  // of small objects needs about half of it; one of fields without content may need more.
  const int64_t most_memory_of_request;
  const int64_t max_message_bytes;
  // Files of imports and backups on disk: --max_scratch_bytes.
  admission::Budget scratch_bytes;
  // Watch, Replicate and WatchRobots rpcs under way: --max_watchers.
  admission::Budget watchers;
  // Memory of the explorations of all maps: --max_exploration_bytes.
  admission::Budget exploration_bytes;
  // Memory of the content of all maps: --max_content_bytes. The maps share it, too.
  const std::shared_ptr<admission::ContentBudget> content;
  // Memory of the change feeds of all maps, which the maps share, too.
  const std::shared_ptr<FeedMemory> feeds;
  // Calls that their callers have cancelled.
  admission::CancelledCalls cancelled_calls;
  // Bytes of each connection that the server was given as calls and messages.
  admission::ExplainedBytes explained_bytes;
  // Counts the requests that were refused because of a limit.
  admission::Refusals refusals;
  // Bounds the lines of the log about calls that fail.
  LogPace log_pace;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_BUDGETS_H_
