#include "server/rpc/call_context.h"

#include <utility>

#include "base/status/status_macros.h"
#include "server/rpc/correlation.h"
#include "server/rpc/wanted.h"

namespace hypermap::server {
namespace {

// Fills the caller, unless the rpc is open to all.
absl::Status Identify(const AccessControl& access, const grpc::CallbackServerContext& context,
                      Rpc rpc, Caller* caller) {
  if (!InfoOf(rpc).least) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(*caller, access.Identify(context));
  return caller->CheckRpc(rpc);
}

// The client to which a call is counted; empty for its host.
std::string ClientOf(const Caller& caller) { return caller.identity ? caller.identity->name : ""; }

}  // namespace

CallContext::CallContext(const CallFacilities& facilities, grpc::CallbackServerContext* context,
                         Rpc rpc)
    : access_(facilities.access),
      meters_(facilities.meters),
      log_pace_(&facilities.budgets->log_pace),
      rpc_(rpc),
      context_(context),
      peer_(context->peer()),
      admitted_(Identify(*access_, *context, rpc, &caller_)),
      ticket_(facilities.budgets, context, peer_, ClientOf(caller_)),
      log_(*context, rpc) {
  meters_->Began(rpc);
  if (admitted_.ok()) admitted_ = ticket_.admitted();
  if (admitted_.ok()) admitted_ = facilities.budgets->call_rate.Take(ticket_.client());
}

absl::Status CallContext::EnterMap(std::string map) {
  log_.set_map(std::move(map));
  return log_.map().empty() ? absl::OkStatus() : caller_.CheckMap(log_.map());
}

absl::Status CallContext::CheckWanted() const {
  HYPERMAP_RETURN_IF_ERROR(server::CheckWanted(*context_));
  return access_->CheckStill(caller_);
}

std::shared_ptr<Cancellation> CallContext::MakeCancellation() const {
  return std::make_shared<Cancellation>([this] { return CheckWanted(); });
}

absl::StatusOr<std::string> CallContext::author() const {
  if (caller_.identity) return caller_.identity->name;
  return log_.author();
}

void CallContext::Edited(Revision revision, absl::string_view edit_id, int64_t edits) const {
  log_.Edited(revision, edit_id, edits, author().value_or(""));
}

grpc::Status CallContext::End(const absl::Status& status, int64_t items) {
  meters_->Ended(rpc_, status, log_.duration());
  log_.Finished(status, items, caller_, ticket_.host(), *log_pace_);
  if (const std::string id = log_.request_id(); !id.empty()) {
    context_->AddTrailingMetadata(kRequestIdKey, id);
  }
  return ticket_.Encode(status);
}

}  // namespace hypermap::server
