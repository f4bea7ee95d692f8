// An rpc by which a client uploads files in a stream of messages.
#ifndef HYPERMAP_SERVER_SERVICES_UPLOAD_CALL_H_
#define HYPERMAP_SERVER_SERVICES_UPLOAD_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "base/status/unless_memory_fails.h"
#include "server/forward/forwarded_stream.h"
#include "server/rpc/call_context.h"
#include "server/rpc/call_ticket.h"
#include "server/rpc/facilities.h"
#include "server/rpc/raw_messages.h"

namespace hypermap::server {

// A worker takes each message, because that writes to the disk; the next one is read when it has.
// When all have come, a worker of another class carries out the request. So a call has one owner at
// any time: gRPC during a read, until OnReadDone gives the call to a worker, which reads again or
// ends it. Deletes itself in OnDone, which gRPC calls after Finish.
//
// If the first message is about a map that another server owns, the messages are passed on to that
// one, and its answer is the answer.
template <typename Request, typename Response>
class UploadCall : public grpc::ServerReadReactor<grpc::ByteBuffer>,
                   private ForwardedStream::Caller {
 public:
  void OnReadDone(bool ok) final {
    if (forwarded_) return OnReadToForward(ok);
    if (!ok) {
      facilities_->workers->files.Run(
          context_.origin(), [this] { End(UnlessMemoryFails([this] { return CarryOut(); })); });
      return;
    }
    facilities_->workers->uploads.Run(context_.origin(), [this, charged = ChargeMessage()] {
      const bool is_first = std::exchange(expects_first_, false);
      const grpc::ByteBuffer message = is_first ? read_ : grpc::ByteBuffer();
      const absl::Status status =
          charged.ok() ? UnlessMemoryFails([this] { return TakeMessage(); }) : charged;
      if (is_first) {
        if (auto forwarding = context_.ForwardInsteadOf(status)) {
          return PassOn(*std::move(forwarding), message);
        }
      }
      // Removing the files may take long, too.
      if (!status.ok()) return End(status);
      StartRead(&read_);
    });
  }

  void OnDone() final {
    ticket_.LookForCancellation();
    delete this;
  }

 protected:
  // `facilities` must outlive this; context and response live until OnDone.
  UploadCall(grpc::CallbackServerContext* context, const Facilities* facilities,
             grpc::ByteBuffer* response, Rpc rpc)
      : facilities_(facilities),
        context_(facilities->for_calls(), context, rpc),
        ticket_(context_.ticket()),
        encoded_response_(response) {}

  // The last act of the constructor of the class that is made.
  void Begin() {
    if (context_.admitted().ok()) {
      StartRead(&read_);
    } else {
      End(context_.admitted());
    }
  }

  // Takes one message.
  virtual absl::Status Take(Request message) = 0;
  // Carries out the request, when all messages have come. May wait for the disk.
  virtual absl::Status CarryOut() = 0;
  // The answer of a call that was carried out, and the number of items in it.
  virtual const Response& response() const = 0;
  virtual int64_t items() const = 0;
  // Removes the files, so that OnDone need not.
  virtual void RemoveFiles() = 0;

  const Facilities* const facilities_;
  CallContext context_;
  CallTicket& ticket_;  // of context_

 private:
  // Charges for the arrival of the message that was read.
  absl::Status ChargeMessage() {
    ticket_.Received(read_);
    const int64_t cost = CallTicket::CostOnArrival(Request::default_instance(), read_);
    HYPERMAP_RETURN_IF_ERROR(ticket_.ChargeRequest(cost));
    message_cost_ = cost;
    return absl::OkStatus();
  }

  // Takes the message on a worker, and charges for the rest of it meanwhile.
  absl::Status TakeMessage() {
    HYPERMAP_RETURN_IF_ERROR(context_.CheckWanted());
    Request message;
    if (!IsSmallRequest(read_)) {
      const int64_t cost = CallTicket::CostOfRequest(message, read_);
      ticket_.FreeMemory(std::exchange(message_cost_, 0));
      HYPERMAP_RETURN_IF_ERROR(ticket_.ChargeRequest(cost));
      message_cost_ = cost;
    }
    absl::Status status = ParseRequest(read_, &message);
    read_.Clear();
    if (status.ok()) status = Take(std::move(message));
    ticket_.FreeMemory(std::exchange(message_cost_, 0));
    return status;
  }

  void PassOn(Forwarding forwarding, const grpc::ByteBuffer& first) {
    RemoveFiles();
    ticket_.FreeMemory(ticket_.memory());
    ForwardedStream::Caller* const caller = this;
    forwarded_.emplace(caller, &ticket_, ForwardedStream::Requests::kMany, std::move(forwarding));
    forwarded_->Start(first);
  }
  void OnReadToForward(bool ok) {
    if (ok) ticket_.Received(*forwarded_read_);
    forwarded_->OnCallerRead(ok);
  }
  void ReadFromCaller(grpc::ByteBuffer* message) final {
    forwarded_read_ = message;
    StartRead(message);
  }
  // The only answer is written together with the end.
  void WriteToCaller(grpc::ByteBuffer* message) final {
    *encoded_response_ = *message;
    forwarded_->OnCallerWritten(/*ok=*/true);
  }
  void EndForwarded(const ForwardedEnd& end) final { Finish(context_.End(end)); }

  void End(const absl::Status& status) {
    if (status.ok()) {
      const grpc::Slice slice = Serialize(response());
      grpc::ByteBuffer(&slice, 1).Swap(encoded_response_);
    }
    RemoveFiles();
    Finish(context_.End(status, items()));
  }

  grpc::ByteBuffer* const encoded_response_;
  grpc::ByteBuffer read_;  // target of the read under way, or the message that waits for a worker
  int64_t message_cost_ = 0;  // charged for the message
  bool expects_first_ = true;
  std::optional<ForwardedStream> forwarded_;
  grpc::ByteBuffer* forwarded_read_ = nullptr;  // target of the read under way for it
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_UPLOAD_CALL_H_
