// The scope of a query, and the revision that it reads, on the wire.
#ifndef HYPERMAP_WIRE_SCOPE_H_
#define HYPERMAP_WIRE_SCOPE_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/limits/limits.h"
#include "hypermap/v1/scope.pb.h"
#include "map/query/as_of.h"
#include "map/query/query.h"

namespace hypermap::wire {

// RESOURCE_EXHAUSTED if the scope names more than limits.max_layers layers. A map may have more,
// all of which a scope without names has.
absl::Status CheckScope(const v1::Scope& message, const Limits& limits);
// Decodes the layers and the frame. The caller looks up the map. Errors of CheckScope.
absl::StatusOr<Scope> DecodeScope(const v1::Scope& message, const Limits& limits);
void EncodeScope(const std::string& map, const Scope& scope, v1::Scope* message);

// INVALID_ARGUMENT for a negative revision, or a time outside the range of timestamps.
absl::StatusOr<AsOf> DecodeAsOf(const v1::AsOf& message);
void EncodeAsOf(const AsOf& as_of, v1::AsOf* message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_SCOPE_H_
