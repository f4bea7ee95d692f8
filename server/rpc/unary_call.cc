#include "server/rpc/unary_call.h"

#include <utility>

#include "base/cancellation/cancellation.h"
#include "server/rpc/wanted.h"

namespace hypermap::server {

UnaryCall::UnaryCall(Budgets* budgets, grpc::CallbackServerContext* context, absl::string_view rpc,
                     std::string map)
    : UnaryCall(budgets, context, context->DefaultReactor(), rpc, std::move(map)) {}

UnaryCall::UnaryCall(Budgets* budgets, grpc::CallbackServerContext* context,
                     grpc::ServerUnaryReactor* reactor, absl::string_view rpc, std::string map)
    : context_(context),
      reactor_(reactor),
      ticket_(budgets, context),
      log_(*context, rpc, std::move(map)) {}

absl::Status UnaryCall::CheckWanted() const { return server::CheckWanted(*context_); }

std::shared_ptr<Cancellation> UnaryCall::MakeCancellation() const {
  return std::make_shared<Cancellation>(
      [context = context_] { return server::CheckWanted(*context); });
}

void UnaryCall::Finish(const absl::Status& status, int64_t items) {
  log_.Finished(status, items);
  const grpc::Status encoded = ticket_.Encode(status);
  // Before the caller knows the end, so that its next call finds room.
  ticket_.GiveBack();
  reactor_->Finish(encoded);
}

grpc::ServerUnaryReactor* AnswerOn(WorkerPool* workers, UnaryCallPtr call,
                                   absl::AnyInvocable<absl::StatusOr<int64_t>() &&> answer) {
  grpc::ServerUnaryReactor* const reactor = call->reactor();
  if (!call->admitted().ok()) {
    call->Finish(call->admitted());
    return reactor;
  }
  const std::string client = call->log().client();
  workers->Run(client, [call = std::move(call), answer = std::move(answer)]() mutable {
    Cancellation cancellation([&call] { return call->CheckWanted(); });
    absl::StatusOr<int64_t> items = 0;
    {
      const ScopedCancellation here(&cancellation);
      absl::Status status = CheckCancelled();
      items = status.ok() ? std::move(answer)() : std::move(status);
      // Work that was given up has no result.
      if (!cancellation.status().ok()) items = cancellation.status();
    }
    call->Finish(items.status(), items.value_or(0));
  });
  return reactor;
}

grpc::ServerUnaryReactor* StartAtOnce(const UnaryCallPtr& call,
                                      absl::AnyInvocable<absl::Status() &&> start) {
  grpc::ServerUnaryReactor* const reactor = call->reactor();
  absl::Status status = call->admitted();
  if (status.ok()) status = std::move(start)();
  if (!status.ok()) call->Finish(status);
  return reactor;
}

grpc::ServerUnaryReactor* StartOn(WorkerPool* workers, UnaryCallPtr call,
                                  absl::AnyInvocable<absl::Status() &&> start) {
  grpc::ServerUnaryReactor* const reactor = call->reactor();
  if (!call->admitted().ok()) {
    call->Finish(call->admitted());
    return reactor;
  }
  const std::string client = call->log().client();
  workers->Run(client, [call = std::move(call), start = std::move(start)]() mutable {
    absl::Status status;
    {
      // Not asked after `start`, because the call may have ended by then.
      Cancellation cancellation([&call] { return call->CheckWanted(); });
      const ScopedCancellation here(&cancellation);
      status = CheckCancelled();
      if (status.ok()) status = std::move(start)();
    }
    if (!status.ok()) call->Finish(status);
  });
  return reactor;
}

void SubmitAndFinish(UnaryCallPtr call, MapSession& session, EditBatch batch,
                     const std::string& request_id, std::string request_digest,
                     absl::AnyInvocable<void(const storage::Receipt&) &&> respond) {
  const auto edits = static_cast<int64_t>(batch.edits.size());
  absl::StatusOr<std::string> author = call->log().author();
  if (!author.ok()) return call->Finish(author.status());
  Submission submission{std::move(batch), *std::move(author), request_id,
                        std::move(request_digest)};
  submission.cancellation = call->MakeCancellation();
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
