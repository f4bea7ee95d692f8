// What a question is about, and which revision it is asked of, on the wire.
#ifndef HYPERMAP_WIRE_SCOPE_H_
#define HYPERMAP_WIRE_SCOPE_H_

#include <string>

#include "absl/status/statusor.h"
#include "hypermap/v1/scope.pb.h"
#include "map/query/as_of.h"
#include "map/query/query.h"

namespace hypermap::wire {

// The layers and the frame; the map is the caller's to look up.
Scope DecodeScope(const v1::Scope& message);
void EncodeScope(const std::string& map, const Scope& scope, v1::Scope* message);

// INVALID_ARGUMENT for a negative revision, or a time outside of the range of timestamps.
absl::StatusOr<AsOf> DecodeAsOf(const v1::AsOf& message);
void EncodeAsOf(const AsOf& as_of, v1::AsOf* message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_SCOPE_H_
