// Changes of a map on the wire, as in events of a watch and in answers of ListChanges.
#ifndef HYPERMAP_WIRE_CHANGE_H_
#define HYPERMAP_WIRE_CHANGE_H_

#include <vector>

#include "absl/status/status.h"
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
// Adds the changes of a message to `changes`. Errors are those of DecodeChange.
absl::Status AppendChanges(const google::protobuf::RepeatedPtrField<v1::Change>& messages,
                           std::vector<MapChange>& changes);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_CHANGE_H_
