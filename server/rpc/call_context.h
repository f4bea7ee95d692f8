// The context of an rpc under way: its caller, its admission and its log.
#ifndef HYPERMAP_SERVER_RPC_CALL_CONTEXT_H_
#define HYPERMAP_SERVER_RPC_CALL_CONTEXT_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/cancellation/cancellation.h"
#include "map/snapshot.h"
#include "server/auth/access_control.h"
#include "server/auth/caller.h"
#include "server/auth/rpcs.h"
#include "server/forward/forwarder.h"
#include "server/rpc/budgets.h"
#include "server/rpc/call_ticket.h"
#include "server/rpc/request_log.h"
#include "server/rpc/rpc_meters.h"
#include "server/rpc/worker_pool.h"
#include "server/session/site.h"

namespace hypermap::server {

// The parts of a server that admit and log its calls, and pass them on. All must outlive the calls.
struct CallFacilities {
  Budgets* budgets;
  const AccessControl* access;
  RpcMeters* meters;
  const Site* site = nullptr;  // null: no map is owned by another server
  Forwarder* forwarder = nullptr;
};

// Made when a call arrives, before its request is decoded. Not thread safe, apart from CheckWanted
// and what its parts say.
class CallContext {
 public:
  // The context lives as long as this.
  CallContext(const CallFacilities& facilities, grpc::CallbackServerContext* context, Rpc rpc);

  // OK, or the error with which the call must end before any work: nobody knows the caller, it may
  // not call this rpc, or too many calls are under way.
  const absl::Status& admitted() const { return admitted_; }

  // To be called as soon as the request is decoded, before it has any effect; with "" for a request
  // that is about no map. PERMISSION_DENIED if the caller has no access to the map; NotOwnerError
  // if only the owner of the map can answer, which is another server.
  absl::Status EnterMap(std::string map);

  // The same, in addition, for a request that also reads another map; with "" for others. It is
  // never passed on because of that map. REQUIRES: any server answers the rpc, unless `map` is "".
  absl::Status EnterSourceMap(std::string map);

  // As server::CheckWanted; also UNAUTHENTICATED or PERMISSION_DENIED once the caller is not what
  // it was when the call began. Thread safe.
  absl::Status CheckWanted() const;
  // Tells the loops of work for this call whether to go on. Must not be used after End.
  std::shared_ptr<Cancellation> MakeCancellation() const;

  const Caller& caller() const { return caller_; }
  // The author of the changes that the request makes: the caller's identity. Of a server that knows
  // no identities: RequestLog::author.
  absl::StatusOr<std::string> author() const;
  // As RequestLog::Edited.
  void Edited(Revision revision, absl::string_view edit_id, int64_t edits) const;
  // The client and connection of the call, valid as long as this.
  WorkerPool::Origin origin() const { return {ticket_.client(), peer_}; }
  const std::string& map() const { return log_.map(); }

  CallTicket& ticket() { return ticket_; }
  const CallTicket& ticket() const { return ticket_; }

  // The forwarder and the call that must be passed on instead of ending with `error`; nullopt if it
  // must end, because this is no NotOwnerError, another server has passed it on already, or there
  // is no forwarder. Until then nothing may have been answered.
  std::optional<Forwarding> ForwardInsteadOf(const absl::Status& error);

  // Logs the end of the call, tells the caller the name under which it was logged, and returns the
  // status for gRPC. One of these must be called, once; the second for a call that was passed on.
  grpc::Status End(const absl::Status& status, int64_t items = 0);
  grpc::Status End(ForwardedEnd end);

 private:
  void LogEnd(const absl::Status& status, int64_t items);
  // What the owner of the map must know of the call.
  std::vector<std::pair<std::string, std::string>> MetadataForOwner() const;

  const AccessControl* const access_;
  RpcMeters* const meters_;
  const Site* const site_;
  Forwarder* const forwarder_;
  LogPace* const log_pace_;
  const Rpc rpc_;
  grpc::CallbackServerContext* const context_;
  const std::string peer_;  // gRPC makes it anew each time that it is asked for
  Caller caller_;
  absl::Status admitted_;
  CallTicket ticket_;
  RequestLog log_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_CALL_CONTEXT_H_
