// Errors on the wire: the only conversion between absl::Status and grpc::Status.
#ifndef HYPERMAP_WIRE_STATUS_H_
#define HYPERMAP_WIRE_STATUS_H_

#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace hypermap::wire {

// Messages of more than 2,000 bytes are cut.
grpc::Status EncodeStatus(const absl::Status& status);
absl::Status DecodeStatus(const grpc::Status& status);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_STATUS_H_
