#include "server/rpc/budgets.h"

#include <spdlog/spdlog.h>

#include "server/rpc/request_log.h"

namespace hypermap::server {
namespace {

void LogRefusal(const admission::Refusals::Line& line) {
  spdlog::warn("calls are refused limit={} since_start={} last={}", LogQuoted(line.flag),
               line.count, LogQuoted(line.message));
}

}  // namespace

Budgets::Budgets(const Limits& limits)
    : calls("max_calls", limits.max_calls, {.unit = "calls"}),
      request_bytes("max_request_bytes", limits.max_request_bytes, {.takes_one_larger = true}),
      scratch_bytes("max_scratch_bytes", limits.max_scratch_bytes),
      exploration_bytes("max_exploration_bytes", limits.max_exploration_bytes,
                        {.whole_for_one_client = true}),
      refusals(LogRefusal) {}

}  // namespace hypermap::server
