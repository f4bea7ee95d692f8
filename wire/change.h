// Changes of a map on the wire, as in events of a watch and in answers of ListChanges.
#ifndef HYPERMAP_WIRE_CHANGE_H_
#define HYPERMAP_WIRE_CHANGE_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/watch/map_change.h"

namespace hypermap::wire {

v1::ChangeKind EncodeChangeKind(ChangeKind kind);
// INVALID_ARGUMENT for a kind that is missing or unknown.
absl::StatusOr<ChangeKind> DecodeChangeKind(absl::string_view field, v1::ChangeKind kind);

// Transforms objects and cells to the caller's frame.
void EncodeChange(const MapChange& change, v1::Change* message);
// INVALID_ARGUMENT naming the field that is missing or invalid.
absl::StatusOr<MapChange> DecodeChange(const v1::Change& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_CHANGE_H_
