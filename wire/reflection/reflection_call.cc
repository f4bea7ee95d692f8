#include "wire/reflection/reflection_call.h"

#include <grpcpp/support/slice.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "base/sync/cancel_scope.h"

namespace hypermap::reflection {
namespace {

// A request is in memory twice, as bytes and as a message; then its texts are twice in the answer.
constexpr int64_t kForms = 4;

absl::Status Gone() { return absl::CancelledError("the caller went away"); }
absl::Status Stopping() { return absl::UnavailableError("the server is stopping"); }

}  // namespace

bool OpenReflectionCalls::Add(ReflectionCall* call) {
  MutexLock lock(&mutex_);
  if (stopping_) return false;
  calls_.insert(call);
  return true;
}

void OpenReflectionCalls::Remove(ReflectionCall* call) {
  MutexLock lock(&mutex_);
  calls_.erase(call);
}

void OpenReflectionCalls::Stop() {
  // While the lock is held no call is deleted, because OnDone waits for it in Remove. This can't
  // deadlock, because gRPC calls OnDone on another thread than the one that calls Finish.
  MutexLock lock(&mutex_);
  stopping_ = true;
  for (ReflectionCall* call : calls_) call->End(Stopping());
}

ReflectionCall::ReflectionCall(const grpc::CallbackServerContext* context,
                               std::unique_ptr<Ticket> ticket, ServedSchema* schema,
                               OpenReflectionCalls* calls)
    : context_(context), schema_(schema), calls_(calls), ticket_(std::move(ticket)) {
  // A call that was added may be ended by Stop at once; hence it is added before the lock is taken.
  const bool is_added = calls->Add(this);
  MutexLock lock(&mutex_);
  if (const absl::Status admitted = ticket_->admitted(); !admitted.ok()) {
    EndLocked(admitted);
  } else if (!is_added) {
    EndLocked(Stopping());
  } else if (!finished_) {
    StartRead(&request_);
  }
}

void ReflectionCall::OnReadDone(bool ok) {
  MutexLock lock(&mutex_);
  if (finished_) return;
  if (!ok) return EndLocked(context_->IsCancelled() ? Gone() : absl::OkStatus());
  if (const absl::Status status = Answer(); !status.ok()) return EndLocked(status);
  writing_ = true;
  StartWrite(&answer_);
}

void ReflectionCall::OnWriteDone(bool ok) {
  MutexLock lock(&mutex_);
  writing_ = false;
  answer_.Clear();
  ticket_->FreeMemory(std::exchange(charged_, 0));
  if (!ok) {
    return EndLocked(context_->IsCancelled()
                         ? Gone()
                         : absl::ResourceExhaustedError(
                               "the answer is larger than the server's limit of messages"));
  }
  if (ended_) return EndLocked(status_);
  StartRead(&request_);
}

void ReflectionCall::OnCancel() {
  const CancelScope in_cancel(this);
  End(Gone());
}

void ReflectionCall::OnDone() {
  calls_->Remove(this);
  { const MutexLock lock(&mutex_); }  // The thread that called Finish may still hold it.
  delete this;
}

void ReflectionCall::End(const absl::Status& status) {
  MutexLock lock(&mutex_);
  EndLocked(status);
}

void ReflectionCall::EndLocked(const absl::Status& status) {
  if (!std::exchange(ended_, true)) status_ = status;
  if (writing_ || std::exchange(finished_, true)) return;
  Finish(ticket_->Encode(status_));
}

absl::Status ReflectionCall::Answer() {
  grpc::ByteBuffer bytes;
  bytes.Swap(&request_);
  if (bytes.Length() > kMaxRequestBytes) {
    return absl::ResourceExhaustedError(absl::StrCat("the request has ", bytes.Length(),
                                                     " bytes, more than the ", kMaxRequestBytes,
                                                     " that this rpc takes"));
  }
  if (bytes.Length() > kFreeBytes) {
    const int64_t cost = kForms * static_cast<int64_t>(bytes.Length());
    HYPERMAP_RETURN_IF_ERROR(ticket_->ChargeMemory(cost));
    charged_ = cost;
  }
  grpc::Slice slice;
  v1::ServerReflectionRequest request;
  if (!bytes.DumpToSingleSlice(&slice).ok() ||
      !request.ParseFromArray(slice.begin(), static_cast<int>(slice.size()))) {
    return absl::InvalidArgumentError(absl::StrCat("the request is not a ", request.GetTypeName()));
  }
  schema_->Answer(std::move(request)).Swap(&answer_);
  return absl::OkStatus();
}

}  // namespace hypermap::reflection
