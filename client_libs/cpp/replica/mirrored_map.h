// Builds the mirrored part of a map from the events of Client::Replicate.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_MIRRORED_MAP_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_MIRRORED_MAP_H_

#include "absl/status/statusor.h"
#include "client_libs/cpp/watch.h"
#include "map/snapshot.h"

namespace hypermap::client {

// Returns the map after an event of Client::Replicate. The event applies to
// `before`, or to an empty map if it is a snapshot. Unchanged parts are shared with `before`.
// INTERNAL if the event does not fit.
absl::StatusOr<SnapshotPtr> After(const Snapshot& before, const WatchEvent& event);

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_MIRRORED_MAP_H_
