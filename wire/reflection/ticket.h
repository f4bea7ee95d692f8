// The admission of a reflection stream.
#ifndef HYPERMAP_WIRE_REFLECTION_TICKET_H_
#define HYPERMAP_WIRE_REFLECTION_TICKET_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <cstdint>
#include <functional>
#include <memory>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace hypermap::reflection {

// Counts a stream among the calls of its server from its construction to its destruction. Each
// server has its own. Only one thread at a time uses it.
class Ticket {
 public:
  virtual ~Ticket() = default;

  // OK, or the error with which the stream must end before a request is read.
  virtual absl::Status admitted() const = 0;
  // OK if the caller may learn of the service with this name. Only the health service asks.
  virtual absl::Status CheckName(absl::string_view /*name*/) const { return absl::OkStatus(); }
  // Charges memory that the stream will hold, or returns the error with which it must end.
  virtual absl::Status ChargeMemory(int64_t bytes) = 0;
  // Gives back a part of what was charged.
  virtual void FreeMemory(int64_t bytes) = 0;
  // Returns the status with which the stream ends, as gRPC encodes it. CANCELLED if the client has
  // gone or its deadline has passed. Called once.
  virtual grpc::Status Encode(const absl::Status& status) = 0;
};

// Makes the ticket of a new stream, whose context outlives it. Called by gRPC's threads.
using Admit = std::function<std::unique_ptr<Ticket>(grpc::CallbackServerContext* context)>;

}  // namespace hypermap::reflection

#endif  // HYPERMAP_WIRE_REFLECTION_TICKET_H_
