#include "server/services/access_service.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "server/auth/caller.h"
#include "server/auth/rpcs.h"
#include "server/rpc/unary_call.h"
#include "wire/access.h"
#include "wire/time.h"

namespace hypermap::server {
namespace {

void Describe(const Caller& caller, v1::GetCallerResponse* response) {
  response->set_has_identities(caller.identity != nullptr);
  if (caller.identity == nullptr) return;
  const access::Identity& identity = *caller.identity;
  response->set_identity(identity.name);
  response->set_role(wire::EncodeRole(identity.role));
  response->mutable_maps()->Assign(identity.maps.begin(), identity.maps.end());
  response->mutable_robots()->Assign(identity.robots.begin(), identity.robots.end());
  if (caller.expires != absl::InfiniteFuture()) {
    wire::EncodeTime(caller.expires, response->mutable_expires());
  }
  for (const RpcInfo& info : AllRpcs()) {
    if (!info.least) continue;
    v1::RpcRole* const rpc = response->add_rpcs();
    rpc->set_rpc(absl::StrCat(info.service, "/", info.method));
    rpc->set_least(wire::EncodeRole(*info.least));
  }
}

}  // namespace

grpc::ServerUnaryReactor* AccessService::GetCaller(grpc::CallbackServerContext* context,
                                                   const grpc::ByteBuffer* request,
                                                   grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::GetCallerRequest, v1::GetCallerResponse>(
      facilities_.for_calls(), context, Rpc::kGetCaller, {request, response});
  return AnswerOn(&facilities_.workers->questions, call, [call]() -> absl::StatusOr<int64_t> {
    Describe(call->context().caller(), call->response());
    return 1;
  });
}

}  // namespace hypermap::server
