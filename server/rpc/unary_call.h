// Requests with one answer.
#ifndef HYPERMAP_SERVER_RPC_UNARY_CALL_H_
#define HYPERMAP_SERVER_RPC_UNARY_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <memory>
#include <string>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/rpc/request_log.h"
#include "server/rpc/worker_pool.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// One request that is being answered. The request and response messages live until Finish.
class UnaryCall {
 public:
  // `rpc` outlives this.
  UnaryCall(grpc::CallbackServerContext* context, absl::string_view rpc, std::string map);
  // With a reactor of its own, which is there until Finish.
  UnaryCall(grpc::CallbackServerContext* context, grpc::ServerUnaryReactor* reactor,
            absl::string_view rpc, std::string map);

  grpc::ServerUnaryReactor* reactor() const { return reactor_; }
  const RequestLog& log() const { return log_; }
  absl::Status CheckWanted() const;

  // Ends the call; called once.
  void Finish(const absl::Status& status, int64_t items = 0);

 private:
  grpc::CallbackServerContext* const context_;
  grpc::ServerUnaryReactor* const reactor_;
  RequestLog log_;
};

using UnaryCallPtr = std::shared_ptr<UnaryCall>;

// Runs `answer`, which fills the response and returns the number of answers in it, on a worker, and
// ends the call. Not run when nobody waits for it any more.
grpc::ServerUnaryReactor* AnswerOn(WorkerPool* workers, UnaryCallPtr call,
                                   absl::AnyInvocable<absl::StatusOr<int64_t>() &&> answer);

// Runs `start`, which takes over the ending of the call unless it returns an error, on a worker.
grpc::ServerUnaryReactor* StartOn(WorkerPool* workers, UnaryCallPtr call,
                                  absl::AnyInvocable<absl::Status() &&> start);
// The same at once, on gRPC's thread; for what is short.
grpc::ServerUnaryReactor* StartAtOnce(const UnaryCallPtr& call,
                                      absl::AnyInvocable<absl::Status() &&> start);

// Hands a batch to the map's writer, and ends the call when it is on disk: `respond` fills the
// response from the receipt.
void SubmitAndFinish(UnaryCallPtr call, MapSession& session, EditBatch batch,
                     const std::string& request_id,
                     absl::AnyInvocable<void(const storage::Receipt&) &&> respond);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_UNARY_CALL_H_
