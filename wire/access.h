// Roles on the wire.
#ifndef HYPERMAP_WIRE_ACCESS_H_
#define HYPERMAP_WIRE_ACCESS_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/identity/role.h"
#include "hypermap/v1/access_service.pb.h"

namespace hypermap::wire {

v1::Role EncodeRole(access::Role role);
// INVALID_ARGUMENT for a role that is missing or unknown.
absl::StatusOr<access::Role> DecodeRole(absl::string_view field, v1::Role role);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_ACCESS_H_
