#include "wire/health/messages.h"

#include <grpcpp/support/slice.h>

#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::health {

absl::StatusOr<std::string> TakeServiceName(const reflection::Ticket& ticket,
                                            grpc::ByteBuffer* request) {
  HYPERMAP_RETURN_IF_ERROR(ticket.admitted());
  grpc::ByteBuffer bytes;
  bytes.Swap(request);
  if (bytes.Length() > kMaxRequestBytes) {
    return absl::ResourceExhaustedError(absl::StrCat("the request has ", bytes.Length(),
                                                     " bytes, more than the ", kMaxRequestBytes,
                                                     " that this rpc takes"));
  }
  grpc::Slice slice;
  grpc::health::v1::HealthCheckRequest message;
  if (!bytes.DumpToSingleSlice(&slice).ok() ||
      !message.ParseFromArray(slice.begin(), static_cast<int>(slice.size()))) {
    return absl::InvalidArgumentError(absl::StrCat("the request is not a ", message.GetTypeName()));
  }
  if (message.service().size() > kMaxNameBytes) {
    return absl::InvalidArgumentError(absl::StrCat("service has ", message.service().size(),
                                                   " bytes, more than ", kMaxNameBytes));
  }
  HYPERMAP_RETURN_IF_ERROR(ticket.CheckName(message.service()));
  return std::move(*message.mutable_service());
}

grpc::ByteBuffer Encode(ServingStatus status) {
  HealthCheckResponse response;
  response.set_status(status);
  const grpc::Slice slice(response.SerializeAsString());
  return grpc::ByteBuffer(&slice, 1);
}

}  // namespace hypermap::health
