// The admission of one call.
#ifndef HYPERMAP_SERVER_RPC_CALL_TICKET_H_
#define HYPERMAP_SERVER_RPC_CALL_TICKET_H_

#include <google/protobuf/message.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/status.h>

#include <atomic>
#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/admission/budget.h"
#include "base/admission/explained_bytes.h"
#include "base/metering/memory_meter.h"
#include "base/sync/steady_time.h"
#include "server/forward/forwarder.h"
#include "server/rpc/budgets.h"
#include "server/rpc/raw_messages.h"

namespace hypermap::server {

// Counts a call among those under way from its construction to its end, together with the memory of
// its request. Clients are told apart by their identities, or else by their hosts
// (base/admission/client_host.h). Every call has one, made before its request is decoded. Not
// thread safe.
class CallTicket final : public MemoryAccount {
 public:
  // Requests up to this size are not charged: --max_calls bounds them.
  static constexpr int64_t kFreeBytes = 1 << 10;
  // The same for answers.
  static constexpr int64_t kFreeAnswerBytes = 16 << 10;

  // Both must outlive this; the context is used by Encode only.
  CallTicket(Budgets* budgets, grpc::CallbackServerContext* context);
  // The same for a peer as gRPC writes it, such as "ipv4:127.0.0.1:4711". `identity` is the
  // caller's, or empty if it is not known.
  CallTicket(Budgets* budgets, grpc::CallbackServerContext* context, absl::string_view peer,
             absl::string_view identity = "");
  CallTicket(const CallTicket&) = delete;
  CallTicket& operator=(const CallTicket&) = delete;

  const std::string& host() const { return explained_.host(); }
  // The client to which the call is counted: an identity or a host.
  const std::string& client() const { return client_; }

  // OK, or the error with which the call must end at once, because --max_calls are under way.
  const absl::Status& admitted() const { return admitted_; }

  // Tells that the call was given this message of its client. To be called once for each message,
  // whether it is accepted or not.
  void Received(const grpc::ByteBuffer& message) {
    explained_.Explain(static_cast<int64_t>(message.Length()));
  }

  // The memory that a request takes: as gRPC received it, as a message of the prototype's type, and
  // as decoded, which takes about as much as the message. 0 for one that is not charged.
  static int64_t CostOfRequest(const google::protobuf::Message& prototype,
                               const grpc::ByteBuffer& bytes);

  // The memory that an encoded answer takes until it is sent. 0 for one that is not charged.
  static int64_t CostOfAnswer(int64_t bytes) { return bytes <= kFreeAnswerBytes ? 0 : bytes; }

  // Charges for a request, or returns the error with which the call must end: RESOURCE_EXHAUSTED
  // naming --max_request_bytes, or --max_message_bytes if the message would take far more memory
  // than one of that size should. To be called before the request is parsed.
  absl::Status ChargeRequest(const google::protobuf::Message& prototype,
                             const grpc::ByteBuffer& bytes) {
    return ChargeRequest(CostOfRequest(prototype, bytes));
  }
  // The same for a cost that is known.
  absl::Status ChargeRequest(int64_t cost);

  // The same in two steps, of which only the second takes long for a large request: ChargeArrival
  // on gRPC's thread, and ChargeRest on the worker that is about to parse it. A small request is
  // charged at its arrival. After an error, nothing is charged for the request.
  absl::Status ChargeArrival(const google::protobuf::Message& prototype,
                             const grpc::ByteBuffer& bytes) {
    return ChargeRequest(CostOnArrival(prototype, bytes));
  }
  absl::Status ChargeRest(const google::protobuf::Message& prototype,
                          const grpc::ByteBuffer& bytes);
  // Returns the cost that ChargeArrival charges. Only the bytes of a large request count, because
  // counting its fields takes long.
  static int64_t CostOnArrival(const google::protobuf::Message& prototype,
                               const grpc::ByteBuffer& bytes) {
    return IsSmallRequest(bytes) ? CostOfRequest(prototype, bytes)
                                 : static_cast<int64_t>(bytes.Length());
  }

  // Charges this many bytes of memory, which the call holds until its end or until FreeMemory.
  absl::Status ChargeMemory(int64_t bytes) override;
  // The bytes that are charged.
  int64_t memory() const { return memory_.amount(); }
  // Gives back a part of them.
  void FreeMemory(int64_t bytes) override { memory_.GiveBack(bytes); }

  // Returns the status with which the call ends, as gRPC encodes it. Counts it if it is a refusal,
  // and tells the caller when to come again if a later call may succeed: the trailing metadata
  // grpc-retry-pushback-ms (gRFC A6).
  grpc::Status Encode(const absl::Status& status);
  // The same for a call that another server has answered or refused.
  grpc::Status Encode(const ForwardedEnd& end);

  // Counts the call as cancelled by its caller, once. Encode does so for calls that end with
  // CANCELLED; OnCancel of a stream may call it earlier. Any thread may call this.
  void Cancelled();
  // Counts the call if gRPC reports that the caller has cancelled it. Call this in OnDone of
  // streams of requests: to OnReadDone, a stream that was reset looks like one that has ended.
  void LookForCancellation();

  // Ends the admission of a call whose answer is complete.
  void GiveBack();

 private:
  Budgets* const budgets_;
  grpc::CallbackServerContext* const context_;
  admission::ExplainedBytes::Call explained_;
  const std::string client_;
  admission::Budget::Charge call_;
  admission::Budget::Charge memory_;
  const absl::Status admitted_;
  const SteadyTime begin_;
  std::atomic<bool> is_cancelled_ = false;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_CALL_TICKET_H_
