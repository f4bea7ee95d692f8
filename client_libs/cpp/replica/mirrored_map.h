// The mirrored part of a map, as the events of a watch make it.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_MIRRORED_MAP_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_MIRRORED_MAP_H_

#include "absl/status/statusor.h"
#include "client_libs/cpp/watch.h"
#include "map/snapshot.h"

namespace hypermap::client {

// The map after an event of a watch as stored (WatchOptions::as_stored): of `before`, or of nothing
// when the event is a snapshot. What did not change is shared with `before`. INTERNAL for an event
// that does not fit.
absl::StatusOr<SnapshotPtr> After(const Snapshot& before, const WatchEvent& event);

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_MIRRORED_MAP_H_
