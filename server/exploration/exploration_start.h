// The edits that start an exploration.
#ifndef HYPERMAP_SERVER_EXPLORATION_EXPLORATION_START_H_
#define HYPERMAP_SERVER_EXPLORATION_EXPLORATION_START_H_

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/edits/edit.h"
#include "map/snapshot.h"
#include "server/exploration/exploration_calls.h"

namespace hypermap::server {

// Creates the layers that `snapshot` lacks; the last edit puts the exploration, started at `now`.
// INVALID_ARGUMENT naming the field; NOT_FOUND for the occupancy layer or the frame;
// FAILED_PRECONDITION for a layer of another kind.
absl::StatusOr<EditBatch> StartBatch(const Snapshot& snapshot, const ExplorationStart& request,
                                     absl::Time now);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_EXPLORATION_START_H_
