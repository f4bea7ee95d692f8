#include "server/rpc/call_ticket.h"

#include "absl/random/random.h"
#include "absl/strings/str_cat.h"
#include "base/admission/refusals.h"
#include "base/sync/steady_time.h"
#include "server/rpc/wanted.h"
#include "wire/message_memory.h"
#include "wire/status.h"

namespace hypermap::server {
namespace {

// Time after which a refused caller may try again, drawn at random so that not all come at once.
constexpr int kShortestPause_ms = 100;
constexpr int kLongestPause_ms = 1000;
// A large request is in memory twice: as a message, and as decoded.
constexpr int64_t kForms = 2;

// No host looks like this.
std::string ClientOfIdentity(absl::string_view identity) {
  return absl::StrCat("identity ", identity);
}

}  // namespace

CallTicket::CallTicket(Budgets* budgets, grpc::CallbackServerContext* context)
    : CallTicket(budgets, context, context->peer()) {}

CallTicket::CallTicket(Budgets* budgets, grpc::CallbackServerContext* context,
                       absl::string_view peer, absl::string_view identity)
    : budgets_(budgets),
      context_(context),
      explained_(&budgets->explained_bytes, peer),
      client_(identity.empty() ? explained_.host() : ClientOfIdentity(identity)),
      call_(&budgets->calls, client_),
      memory_(&budgets->request_bytes, client_),
      admitted_(call_.Add(1)),
      begin_(SteadyTime::Now()) {}

int64_t CallTicket::CostOfRequest(const google::protobuf::Message& prototype,
                                  const grpc::ByteBuffer& bytes) {
  const auto size = static_cast<int64_t>(bytes.Length());
  return size <= kFreeBytes ? 0 : size + kForms * wire::MemoryOfMessage(prototype, bytes);
}

absl::Status CallTicket::ChargeRequest(int64_t cost) {
  if (cost > budgets_->most_memory_of_request) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the request would take ", cost, " bytes of memory, more than ",
                     budgets_->most_memory_of_request, ", which is 32 times --max_message_bytes"));
  }
  return ChargeMemory(cost);
}

absl::Status CallTicket::ChargeRest(const google::protobuf::Message& prototype,
                                    const grpc::ByteBuffer& bytes) {
  if (IsSmallRequest(bytes)) return absl::OkStatus();
  const int64_t cost = CostOfRequest(prototype, bytes);
  // Given back first: a request that exceeds its client's part is accepted only while the client
  // holds nothing.
  FreeMemory(static_cast<int64_t>(bytes.Length()));
  return ChargeRequest(cost);
}

absl::Status CallTicket::ChargeMemory(int64_t bytes) {
  return bytes == 0 ? absl::OkStatus() : memory_.Add(bytes);
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

grpc::Status CallTicket::Encode(const ForwardedEnd& end) {
  if (!end.pushback_ms.empty()) context_->AddTrailingMetadata(kPushbackKey, end.pushback_ms);
  if (absl::IsCancelled(end.status)) Cancelled();
  return wire::EncodeStatus(end.status);
}

void CallTicket::Cancelled() {
  if (is_cancelled_.exchange(true)) return;
  budgets_->cancelled_calls.Count(context_->peer(), SteadyTime::Now() - begin_);
}

void CallTicket::LookForCancellation() {
  if (absl::IsCancelled(CheckWanted(*context_))) Cancelled();
}

void CallTicket::GiveBack() {
  memory_.GiveBack();
  call_.GiveBack();
}

}  // namespace hypermap::server
