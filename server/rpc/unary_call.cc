#include "server/rpc/unary_call.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/status/unless_memory_fails.h"
#include "base/sync/cancel_scope.h"

namespace hypermap::server {
namespace {

// A large answer is in memory as a message, whose parts take a few times their bytes, and encoded.
constexpr int64_t kBytesOfAnswerByte = 4;

}  // namespace

UnaryCall::UnaryCall(const CallFacilities& facilities, grpc::CallbackServerContext* context,
                     Rpc rpc, const RawMessages& raw)
    : reactor_(this),
      context_(facilities, context, rpc),
      raw_(raw),
      max_answer_bytes_(facilities.budgets->max_message_bytes),
      admitted_(context_.admitted()) {}

absl::Status UnaryCall::EnsureParsed() {
  if (is_parsed_) return absl::OkStatus();
  HYPERMAP_RETURN_IF_ERROR(Parse());
  is_parsed_ = true;
  return absl::OkStatus();
}

absl::Status UnaryCall::ReserveAnswer(int64_t bytes) {
  answer_bytes_ += bytes;
  if (answer_bytes_ > max_answer_bytes_) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the answer is larger than --max_message_bytes, ", max_answer_bytes_, " bytes",
                     advice_.empty() ? "" : "; ", advice_));
  }
  if (answer_bytes_ <= CallTicket::kFreeAnswerBytes) return absl::OkStatus();
  const int64_t missing = kBytesOfAnswerByte * answer_bytes_ - answer_charge_;
  HYPERMAP_RETURN_IF_ERROR(ticket().ChargeMemory(missing));
  answer_charge_ += missing;
  return absl::OkStatus();
}

void UnaryCall::ForgetAnswer() {
  ClearResponse();
  answer_bytes_ = 0;
  ticket().FreeMemory(std::exchange(answer_charge_, 0));
}

void UnaryCall::Finish(absl::Status status, int64_t items) {
  if (auto forwarding = context_.ForwardInsteadOf(status)) return PassOn(*std::move(forwarding));
  if (status.ok()) {
    const grpc::Slice slice = EncodeResponse();
    grpc::ByteBuffer(&slice, 1).Swap(raw_.response);
  }
  FreeAll();
  if (status.ok()) status = ChargeResponse();
  const grpc::Status encoded = context_.End(status, items);
  reactor_.Finish(encoded);
}

void UnaryCall::FreeAll() {
  FreeMessages();
  ticket().FreeMemory(ticket().memory());
}

absl::Status UnaryCall::ChargeResponse() {
  const auto bytes = static_cast<int64_t>(raw_.response->Length());
  absl::Status status = ticket().ChargeMemory(CallTicket::CostOfAnswer(bytes));
  if (!status.ok()) raw_.response->Clear();
  return status;
}

void UnaryCall::PassOn(Forwarding forwarding) {
  FreeAll();
  // Only its bytes are held from now on.
  const auto bytes = static_cast<int64_t>(raw_.request->Length());
  const absl::Status charged = ticket().ChargeMemory(bytes <= CallTicket::kFreeBytes ? 0 : bytes);
  if (!charged.ok()) return reactor_.Finish(context_.End(charged));
  forwarding.forwarder->Call(std::move(forwarding.call), raw_.request, raw_.response,
                             [this](ForwardedEnd end) {
                               ticket().FreeMemory(ticket().memory());
                               if (end.status.ok()) end.status = ChargeResponse();
                               reactor_.Finish(context_.End(std::move(end)));
                             });
}

void UnaryCall::Reactor::OnCancel() {
  const CancelScope in_cancel(this);
  if (call_.wait_) call_.wait_->Stop();
}

void UnaryCall::Reactor::OnDone() {
  // Deletes the call and this, unless a worker is about to forget the call.
  const std::shared_ptr<UnaryCall> call = std::move(call_.self_);
}

absl::Status ReservePart(UnaryCall& call, const google::protobuf::Message& part) {
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  return call.ReserveAnswer(static_cast<int64_t>(part.ByteSizeLong()));
}

grpc::ServerUnaryReactor* AnswerOn(WorkerPool* workers, UnaryCallPtr call,
                                   absl::AnyInvocable<absl::StatusOr<int64_t>() &&> answer,
                                   Turns turns) {
  grpc::ServerUnaryReactor* const reactor = call->reactor();
  if (!call->admitted().ok()) {
    call->Finish(call->admitted());
    return reactor;
  }
  if (turns == Turns::kOnePerMap && !call->is_parsed()) {
    // The request is parsed first, because it names the map.
    return StartOn(workers, call, [workers, call, answer = std::move(answer), turns]() mutable {
      AnswerOn(workers, call, std::move(answer), turns);
      return absl::OkStatus();
    });
  }
  const WorkerPool::Origin origin = call->context().origin();
  const std::string subject = turns == Turns::kOnePerMap ? call->context().map() : "";
  workers->Run(origin, subject, [call = std::move(call), answer = std::move(answer)]() mutable {
    Cancellation cancellation([&call] { return call->CheckWanted(); });
    absl::StatusOr<int64_t> items = 0;
    {
      const ScopedCancellation here(&cancellation);
      MemoryMeter meter(&call->ticket());
      const ScopedMeter metered(&meter);
      absl::Status status = CheckCancelled();
      const auto parse_and_answer = [&]() -> absl::StatusOr<int64_t> {
        HYPERMAP_RETURN_IF_ERROR(call->EnsureParsed());
        return std::move(answer)();
      };
      items = status.ok() ? UnlessMemoryFails(parse_and_answer) : std::move(status);
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
  if (status.ok()) status = UnlessMemoryFails([&] { return std::move(start)(); });
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
  const WorkerPool::Origin origin = call->context().origin();
  workers->Run(origin, [call = std::move(call), start = std::move(start)]() mutable {
    absl::Status status;
    {
      // Not asked after `start`, because the call may have ended by then.
      Cancellation cancellation([&call] { return call->CheckWanted(); });
      const ScopedCancellation here(&cancellation);
      status = CheckCancelled();
      const auto parse_and_start = [&] {
        absl::Status parsed = call->EnsureParsed();
        return parsed.ok() ? std::move(start)() : parsed;
      };
      if (status.ok()) status = UnlessMemoryFails(parse_and_start);
    }
    if (!status.ok()) call->Finish(status);
  });
  return reactor;
}

void SubmitAndFinish(UnaryCallPtr call, MapSession& session, EditBatch batch,
                     const std::string& request_id, std::string request_digest,
                     absl::AnyInvocable<void(const storage::Receipt&) &&> respond) {
  const auto edits = static_cast<int64_t>(batch.edits.size());
  absl::StatusOr<std::string> author = call->context().author();
  if (!author.ok()) return call->Finish(author.status());
  Submission submission{std::move(batch), *std::move(author), request_id,
                        std::move(request_digest)};
  submission.cancellation = call->MakeCancellation();
  submission.client = call->ticket().client();
  session.Submit(std::move(submission),
                 [call = std::move(call), request_id, edits,
                  respond = std::move(respond)](absl::StatusOr<storage::Receipt> receipt) mutable {
                   if (receipt.ok()) {
                     call->context().Edited(receipt->revision, request_id, edits);
                     std::move(respond)(*receipt);
                   }
                   call->Finish(receipt.status(), edits);
                 });
}

}  // namespace hypermap::server
