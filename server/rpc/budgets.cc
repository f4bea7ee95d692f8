#include "server/rpc/budgets.h"

#include "base/logging/log.h"

namespace hypermap::server {
namespace {

constexpr int64_t kMemoryOfByte = 32;
// The part of --memory_limit that change feeds may take; see FeedMemory.
constexpr int64_t kPartOfFeeds = 16;

void LogRefusal(const admission::Refusals::Line& line) {
  logging::Log(logging::Level::kWarning, "calls are refused",
               {{"limit", line.flag}, {"since_start", line.count}, {"last", line.message}});
}

}  // namespace

Budgets::Budgets(const Limits& limits)
    : calls("max_calls", limits.max_calls, {.unit = "calls"}),
      call_rate(limits.max_calls_per_second),
      request_bytes("max_request_bytes", limits.max_request_bytes, {.takes_one_larger = true}),
      most_memory_of_request(kMemoryOfByte * limits.max_message_bytes),
      max_message_bytes(limits.max_message_bytes),
      scratch_bytes("max_scratch_bytes", limits.max_scratch_bytes),
      watchers("max_watchers", limits.max_watchers, {.unit = "watches", .takes_one_larger = true}),
      exploration_bytes("max_exploration_bytes", limits.max_exploration_bytes,
                        {.whole_for_one_client = true}),
      content(std::make_shared<admission::ContentBudget>(limits.max_content_bytes)),
      feeds(std::make_shared<FeedMemory>(limits.memory_limit / kPartOfFeeds)),
      refusals(LogRefusal) {}

}  // namespace hypermap::server
