// Unary rpcs: one request, one answer.
#ifndef HYPERMAP_SERVER_RPC_UNARY_CALL_H_
#define HYPERMAP_SERVER_RPC_UNARY_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/cancellation/cancellation.h"
#include "server/rpc/budgets.h"
#include "server/rpc/call_ticket.h"
#include "server/rpc/request_log.h"
#include "server/rpc/worker_pool.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// One unary call that is under way. Its request and response messages live until Finish.
class UnaryCall {
 public:
  // Uses gRPC's default reactor. `budgets` and `rpc` must outlive this.
  UnaryCall(Budgets* budgets, grpc::CallbackServerContext* context, absl::string_view rpc,
            std::string map);
  // Uses `reactor`, which must live until Finish.
  UnaryCall(Budgets* budgets, grpc::CallbackServerContext* context,
            grpc::ServerUnaryReactor* reactor, absl::string_view rpc, std::string map);

  grpc::ServerUnaryReactor* reactor() const { return reactor_; }
  const RequestLog& log() const { return log_; }
  void set_map(std::string map) { log_.set_map(std::move(map)); }
  // As those of CallTicket.
  const absl::Status& admitted() const { return ticket_.admitted(); }
  absl::Status ChargeRequest(int64_t bytes) { return ticket_.ChargeRequest(bytes); }
  // As server::CheckWanted.
  absl::Status CheckWanted() const;
  // Tells the loops of work for this call whether its caller still waits. Must not be used after
  // Finish.
  std::shared_ptr<Cancellation> MakeCancellation() const;

  // Ends the call. Must be called exactly once.
  void Finish(const absl::Status& status, int64_t items = 0);

 private:
  grpc::CallbackServerContext* const context_;
  grpc::ServerUnaryReactor* const reactor_;
  CallTicket ticket_;
  RequestLog log_;
};

using UnaryCallPtr = std::shared_ptr<UnaryCall>;

// Runs `answer` on a worker, then ends the call. `answer` fills the response and returns the number
// of items in it. It is not run if the call was cancelled or its deadline has passed. A call that
// is not admitted ends at once, here and below. `answer` has the call's Cancellation; once that has
// reported an error, the call ends with it, whatever `answer` returns.
grpc::ServerUnaryReactor* AnswerOn(WorkerPool* workers, UnaryCallPtr call,
                                   absl::AnyInvocable<absl::StatusOr<int64_t>() &&> answer);

// Runs `start` on a worker. If it returns an error, the call ends with it; otherwise `start` has
// made sure that the call is ended later. `start` has the call's Cancellation, too.
grpc::ServerUnaryReactor* StartOn(WorkerPool* workers, UnaryCallPtr call,
                                  absl::AnyInvocable<absl::Status() &&> start);
// As StartOn, but on gRPC's thread; for short tasks.
grpc::ServerUnaryReactor* StartAtOnce(const UnaryCallPtr& call,
                                      absl::AnyInvocable<absl::Status() &&> start);

// Hands a batch to the map's writer. When it is on disk, `respond` fills the response from the
// receipt, and the call ends. `request_digest` is that of DigestOf.
void SubmitAndFinish(UnaryCallPtr call, MapSession& session, EditBatch batch,
                     const std::string& request_id, std::string request_digest,
                     absl::AnyInvocable<void(const storage::Receipt&) &&> respond);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_UNARY_CALL_H_
