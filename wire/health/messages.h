// The messages of the health protocol, as bytes.
#ifndef HYPERMAP_WIRE_HEALTH_MESSAGES_H_
#define HYPERMAP_WIRE_HEALTH_MESSAGES_H_

#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <string>

#include "absl/status/statusor.h"
#include "grpc/health/v1/health.pb.h"
#include "wire/reflection/ticket.h"

namespace hypermap::health {

using ServingStatus = grpc::health::v1::HealthCheckResponse::ServingStatus;
using grpc::health::v1::HealthCheckResponse;

// A longer request is not parsed.
inline constexpr size_t kMaxRequestBytes = size_t{4} << 10;
// A longer name is refused, as by gRPC's own health service.
inline constexpr size_t kMaxNameBytes = 200;

// Returns the name of the service whose status is requested, and frees the request. Errors: the
// ticket's if the call is not admitted, or may not learn of the service; RESOURCE_EXHAUSTED if the
// request is too long; INVALID_ARGUMENT if the name is, or if the bytes are not a
// HealthCheckRequest.
absl::StatusOr<std::string> TakeServiceName(const reflection::Ticket& ticket,
                                            grpc::ByteBuffer* request);

// The encoded response.
grpc::ByteBuffer Encode(ServingStatus status);

}  // namespace hypermap::health

#endif  // HYPERMAP_WIRE_HEALTH_MESSAGES_H_
