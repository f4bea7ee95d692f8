#include "server/rpc/call_context.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "server/auth/metadata.h"
#include "server/rpc/author.h"
#include "server/rpc/correlation.h"
#include "server/rpc/wanted.h"
#include "server/session/not_owner.h"

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
      site_(facilities.site),
      forwarder_(facilities.forwarder),
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
  if (log_.map().empty()) return absl::OkStatus();
  HYPERMAP_RETURN_IF_ERROR(caller_.CheckMap(log_.map()));
  // Before the request is looked at further: the owner may know a newer state of the map.
  const bool any_server = InfoOf(rpc_).answered_by == AnsweredBy::kAnyServer;
  return any_server || site_ == nullptr ? absl::OkStatus() : site_->CheckOwner(log_.map());
}

absl::Status CallContext::EnterSourceMap(std::string map) {
  log_.set_source_map(std::move(map));
  return log_.source_map().empty() ? absl::OkStatus() : caller_.CheckMap(log_.source_map());
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

std::optional<Forwarding> CallContext::ForwardInsteadOf(const absl::Status& error) {
  const std::optional<std::string> owner = OwnerAddressOf(error);
  if (!owner || forwarder_ == nullptr || IsForwarded(*context_)) return std::nullopt;
  const RpcInfo& info = InfoOf(rpc_);
  meters_->Forwarded(rpc_);
  log_.set_forwarded_to(*owner);
  return Forwarding{forwarder_,
                    {context_, absl::StrCat("/", info.service, "/", info.method), map(), *owner,
                     *owner, MetadataForOwner()}};
}

std::vector<std::pair<std::string, std::string>> CallContext::MetadataForOwner() const {
  std::vector<std::pair<std::string, std::string>> metadata;
  const auto add = [&](const char* key, absl::string_view value) {
    if (!value.empty()) metadata.emplace_back(key, value);
  };
  add(kRequestIdKey, log_.Name());
  add(kTraceParentKey, MetadataOf(*context_, kTraceParentKey));
  add(kTokenKey, MetadataOf(*context_, kTokenKey));
  if (caller_.identity == nullptr) {
    // By default the author is the caller's address, which the owner does not see.
    const absl::string_view author = MetadataOf(*context_, kAuthorKey);
    add(kAuthorKey, author.empty() ? peer_ : author);
  }
  for (const std::string& name : caller_.certificate_names) add(kCallerCertificateKey, name);
  return metadata;
}

void CallContext::LogEnd(const absl::Status& status, int64_t items) {
  meters_->Ended(rpc_, status, log_.duration());
  log_.Finished(status, items, caller_, ticket_.host(), *log_pace_);
  if (const std::string id = log_.request_id(); !id.empty()) {
    context_->AddTrailingMetadata(kRequestIdKey, id);
  }
}

grpc::Status CallContext::End(const absl::Status& status, int64_t items) {
  LogEnd(status, items);
  const std::optional<std::string> owner = OwnerAddressOf(status);
  if (owner && IsForwarded(*context_)) context_->AddTrailingMetadata(kOwnerKey, *owner);
  return ticket_.Encode(status);
}

grpc::Status CallContext::End(ForwardedEnd end) {
  // The twin of a call that is late is cancelled together with it.
  if (absl::IsCancelled(end.status) && IsPastDeadline(*context_)) end.status = CheckWanted();
  LogEnd(end.status, /*items=*/0);
  return ticket_.Encode(end);
}

}  // namespace hypermap::server
