// Carries out the changes of a commit that was made before, as they were stored.
#ifndef HYPERMAP_MAP_EDITS_REPLAY_H_
#define HYPERMAP_MAP_EDITS_REPLAY_H_

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/edits/change.h"
#include "map/snapshot.h"

namespace hypermap {

// Returns `before` after the changes of the commit `revision`: the snapshot that Apply returned
// when the commit was made, except that next_object_id is only above the ids that the snapshots
// have shown. Layers that do not change are shared with `before`. The content before each change is
// not used. Errors of SnapshotEditor if a change does not fit the map.
absl::StatusOr<SnapshotPtr> Replay(Snapshot before, Revision revision,
                                   absl::Span<const Change> changes);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_REPLAY_H_
