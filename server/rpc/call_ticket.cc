#include "server/rpc/call_ticket.h"

#include "absl/random/random.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/admission/client_host.h"
#include "base/admission/refusals.h"
#include "wire/status.h"

namespace hypermap::server {
namespace {

// Time after which a refused caller may try again, drawn at random so that not all come at once.
constexpr int kShortestPause_ms = 100;
constexpr int kLongestPause_ms = 1000;
constexpr char kPushbackKey[] = "grpc-retry-pushback-ms";

}  // namespace

CallTicket::CallTicket(Budgets* budgets, grpc::CallbackServerContext* context)
    : CallTicket(budgets, context, admission::HostOfPeer(context->peer())) {}

CallTicket::CallTicket(Budgets* budgets, grpc::CallbackServerContext* context,
                       const std::string& client)
    : budgets_(budgets),
      context_(context),
      call_(&budgets->calls, client),
      request_(&budgets->request_bytes, client),
      admitted_(call_.Add(1)),
      begin_(absl::Now()) {}

absl::Status CallTicket::ChargeRequest(int64_t bytes) {
  const int64_t cost = CostOf(bytes);
  return cost == 0 ? absl::OkStatus() : request_.Add(cost);
}

grpc::Status CallTicket::Encode(const absl::Status& status) {
  if (absl::IsResourceExhausted(status)) {
    budgets_->refusals.Count(status);
    if (admission::IsTryLater(status)) {
      absl::InsecureBitGen random;
      const int pause_ms = absl::Uniform(random, kShortestPause_ms, kLongestPause_ms);
      context_->AddTrailingMetadata(kPushbackKey, absl::StrCat(pause_ms));
    }
  }
  if (absl::IsCancelled(status)) Cancelled();
  return wire::EncodeStatus(status);
}

void CallTicket::Cancelled() {
  if (is_cancelled_.exchange(true)) return;
  budgets_->cancelled_calls.Count(context_->peer(), absl::Now() - begin_);
}

void CallTicket::GiveBack() {
  request_.GiveBack();
  call_.GiveBack();
}

}  // namespace hypermap::server
