// The admission of one call.
#ifndef HYPERMAP_SERVER_RPC_CALL_TICKET_H_
#define HYPERMAP_SERVER_RPC_CALL_TICKET_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <atomic>
#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "base/admission/budget.h"
#include "server/rpc/budgets.h"

namespace hypermap::server {

// Counts a call among those under way from its construction to its end, together with the memory of
// its request. Clients are told apart by their hosts (base/admission/client_host.h). Every call has
// one, made before its request is decoded. Not thread safe.
class CallTicket {
 public:
  // Requests up to this size are not charged: --max_calls bounds them.
  static constexpr int64_t kFreeBytes = 16 << 10;
  // Estimate of the bytes that each byte of a large request takes: as gRPC received it, as a
  // message, and as decoded.
  static constexpr int64_t kBytesPerByte = 5;

  // Both must outlive this; the context is used by Encode only.
  CallTicket(Budgets* budgets, grpc::CallbackServerContext* context);

  // OK, or the error with which the call must end at once, because --max_calls are under way.
  const absl::Status& admitted() const { return admitted_; }

  // Charges for a request of this size, or returns the error with which the call must end:
  // RESOURCE_EXHAUSTED naming --max_request_bytes. To be called before the request is decoded.
  absl::Status ChargeRequest(int64_t bytes);
  // The same for this many bytes of memory, which the call holds until its end.
  absl::Status ChargeMemory(int64_t bytes) { return request_.Add(bytes); }
  // Gives back what ChargeRequest has taken for requests of this size, when they were freed before
  // the end of the call.
  void RequestFreed(int64_t bytes) { request_.GiveBack(CostOf(bytes)); }

  // Returns the status with which the call ends, as gRPC encodes it. Counts it if it is a refusal,
  // and tells the caller when to come again if a later call may succeed: the trailing metadata
  // grpc-retry-pushback-ms (gRFC A6).
  grpc::Status Encode(const absl::Status& status);

  // Counts the call among those that were cancelled. Called by Encode; to be called earlier by
  // those who are told earlier. Any thread may call this.
  void Cancelled();

  // Ends the admission of a call whose answer is complete.
  void GiveBack();

 private:
  CallTicket(Budgets* budgets, grpc::CallbackServerContext* context, const std::string& client);

  static int64_t CostOf(int64_t bytes) { return bytes <= kFreeBytes ? 0 : bytes * kBytesPerByte; }

  Budgets* const budgets_;
  grpc::CallbackServerContext* const context_;
  admission::Budget::Charge call_;
  admission::Budget::Charge request_;
  const absl::Status admitted_;
  const absl::Time begin_;
  std::atomic<bool> is_cancelled_ = false;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_CALL_TICKET_H_
