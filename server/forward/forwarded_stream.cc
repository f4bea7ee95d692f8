#include "server/forward/forwarded_stream.h"

#include <grpcpp/generic/generic_stub.h>

#include <utility>

#include "base/sync/cancel_scope.h"

namespace hypermap::server {
namespace {

// The bytes of a message that are charged.
int64_t CostOf(const grpc::ByteBuffer& message) {
  const auto bytes = static_cast<int64_t>(message.Length());
  return bytes <= ForwardedStream::kFreeBytes ? 0 : bytes;
}

}  // namespace

ForwardedStream::ForwardedStream(Caller* caller, MemoryAccount* account, Requests requests,
                                 Forwarding forwarding)
    : caller_(caller),
      account_(account),
      requests_(requests),
      forwarder_(forwarding.forwarder),
      call_(std::move(forwarding.call)),
      channel_(forwarder_->ChannelForStream(call_.address)),
      context_(Forwarder::ContextOf(call_)) {}

void ForwardedStream::Start(const grpc::ByteBuffer& first) {
  absl::Status charged;
  {
    const MutexLock lock(&mutex_);
    charged = Charge(first);
  }
  if (!charged.ok()) return caller_->EndForwarded({charged, "", ""});
  request_ = first;  // refers to the same bytes
  forwarder_->Enter(this, call_);
  grpc::GenericStub(channel_).PrepareBidiStreamingCall(context_.get(), call_.method, {}, this);
  AddMultipleHolds(2);
  StartRead(&answer_);
  if (requests_ == Requests::kOne) {
    StartWriteLast(&request_, grpc::WriteOptions());
  } else {
    StartWrite(&request_);
  }
  StartCall();
}

void ForwardedStream::OnCallerRead(bool ok) {
  absl::Status charged;
  {
    const MutexLock lock(&mutex_);
    if (requests_ended_) return;
    reads_from_caller_ = false;
    if (ok) charged = Charge(request_);
    if (ok && charged.ok()) return StartWrite(&request_);
    requests_ended_ = true;
  }
  if (charged.ok()) {
    StartWritesDone();
  } else {
    Stop(charged);
  }
  RemoveHolds(1);
}

void ForwardedStream::OnWriteDone(bool ok) {
  bool goes_on = false;
  {
    const MutexLock lock(&mutex_);
    Free(&request_);
    goes_on = ok && requests_ == Requests::kMany && !answers_ended_;
    reads_from_caller_ = goes_on;
    requests_ended_ = !goes_on;
  }
  if (goes_on) return caller_->ReadFromCaller(&request_);
  RemoveHolds(1);
}

void ForwardedStream::OnReadDone(bool ok) {
  absl::Status charged;
  int holds = 0;
  {
    const MutexLock lock(&mutex_);
    if (ok) charged = Charge(answer_);
    if (!ok || !charged.ok()) holds = EndAnswers();
  }
  if (holds == 0) return caller_->WriteToCaller(&answer_);
  if (!charged.ok()) Stop(charged);
  RemoveHolds(holds);
}

void ForwardedStream::OnCallerWritten(bool ok) {
  int holds = 0;
  {
    const MutexLock lock(&mutex_);
    Free(&answer_);
    if (!ok) holds = EndAnswers();
  }
  if (ok) return StartRead(&answer_);
  Stop(absl::CancelledError("the caller went away"));
  RemoveHolds(holds);
}

void ForwardedStream::Stop(const absl::Status& status) {
  {
    const MutexLock lock(&mutex_);
    if (stopped_.ok()) stopped_ = status;
  }
  context_->TryCancel();
}

void ForwardedStream::OnDone(const grpc::Status& status) {
  ForwardedEnd end;
  {
    const CancelScope after_all_others(this);
    forwarder_->Leave(this);
    end = Forwarder::EndOf(call_, status, *context_);
    const MutexLock lock(&mutex_);
    if (!stopped_.ok()) end = {stopped_, "", ""};
  }
  caller_->EndForwarded(end);
}

absl::Status ForwardedStream::Charge(const grpc::ByteBuffer& message) {
  const int64_t cost = CostOf(message);
  return cost == 0 ? absl::OkStatus() : account_->ChargeMemory(cost);
}

void ForwardedStream::Free(grpc::ByteBuffer* message) {
  account_->FreeMemory(CostOf(*message));
  message->Clear();
}

int ForwardedStream::EndAnswers() {
  answers_ended_ = true;
  if (!reads_from_caller_) return 1;
  reads_from_caller_ = false;
  requests_ended_ = true;
  return 2;
}

void ForwardedStream::RemoveHolds(int holds) {
  for (; holds > 0; --holds) RemoveHold();
}

}  // namespace hypermap::server
