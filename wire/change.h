// What those who follow a map are told, on the wire.
#ifndef HYPERMAP_WIRE_CHANGE_H_
#define HYPERMAP_WIRE_CHANGE_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/watch/told_change.h"

namespace hypermap::wire {

v1::ChangeKind EncodeChangeKind(ChangeKind kind);
// INVALID_ARGUMENT for a kind that is missing or not known.
absl::StatusOr<ChangeKind> DecodeChangeKind(absl::string_view field, v1::ChangeKind kind);

// Objects and cells in the caller's frame.
void EncodeChange(const ToldChange& change, v1::Change* message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_CHANGE_H_
