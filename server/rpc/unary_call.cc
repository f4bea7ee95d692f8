#include "server/rpc/unary_call.h"

#include <utility>

#include "server/rpc/wanted.h"
#include "wire/status.h"

namespace hypermap::server {

UnaryCall::UnaryCall(grpc::CallbackServerContext* context, absl::string_view rpc, std::string map)
    : UnaryCall(context, context->DefaultReactor(), rpc, std::move(map)) {}

UnaryCall::UnaryCall(grpc::CallbackServerContext* context, grpc::ServerUnaryReactor* reactor,
                     absl::string_view rpc, std::string map)
    : context_(context), reactor_(reactor), log_(*context, rpc, std::move(map)) {}

absl::Status UnaryCall::CheckWanted() const { return server::CheckWanted(*context_); }

void UnaryCall::Finish(const absl::Status& status, int64_t items) {
  log_.Finished(status, items);
  reactor_->Finish(wire::EncodeStatus(status));
}

grpc::ServerUnaryReactor* AnswerOn(WorkerPool* workers, UnaryCallPtr call,
                                   absl::AnyInvocable<absl::StatusOr<int64_t>() &&> answer) {
  grpc::ServerUnaryReactor* const reactor = call->reactor();
  const std::string client = call->log().client();
  workers->Run(client, [call = std::move(call), answer = std::move(answer)]() mutable {
    if (absl::Status status = call->CheckWanted(); !status.ok()) return call->Finish(status);
    const absl::StatusOr<int64_t> items = std::move(answer)();
    call->Finish(items.status(), items.value_or(0));
  });
  return reactor;
}

grpc::ServerUnaryReactor* StartAtOnce(const UnaryCallPtr& call,
                                      absl::AnyInvocable<absl::Status() &&> start) {
  grpc::ServerUnaryReactor* const reactor = call->reactor();
  if (absl::Status status = std::move(start)(); !status.ok()) call->Finish(status);
  return reactor;
}

grpc::ServerUnaryReactor* StartOn(WorkerPool* workers, UnaryCallPtr call,
                                  absl::AnyInvocable<absl::Status() &&> start) {
  grpc::ServerUnaryReactor* const reactor = call->reactor();
  const std::string client = call->log().client();
  workers->Run(client, [call = std::move(call), start = std::move(start)]() mutable {
    absl::Status status = call->CheckWanted();
    if (status.ok()) status = std::move(start)();
    if (!status.ok()) call->Finish(status);
  });
  return reactor;
}

void SubmitAndFinish(UnaryCallPtr call, MapSession& session, EditBatch batch,
                     const std::string& request_id,
                     absl::AnyInvocable<void(const storage::Receipt&) &&> respond) {
  const auto edits = static_cast<int64_t>(batch.edits.size());
  absl::StatusOr<std::string> author = call->log().author();
  if (!author.ok()) return call->Finish(author.status());
  Submission submission{std::move(batch), *std::move(author), request_id};
  session.Submit(std::move(submission),
                 [call = std::move(call), request_id, edits,
                  respond = std::move(respond)](absl::StatusOr<storage::Receipt> receipt) mutable {
                   if (receipt.ok()) {
                     call->log().Edited(receipt->revision, request_id, edits);
                     std::move(respond)(*receipt);
                   }
                   call->Finish(receipt.status(), edits);
                 });
}

}  // namespace hypermap::server
