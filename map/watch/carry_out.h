// Carries out the changes that a subscriber gets on its copy of the map: the reverse of a Follower.
#ifndef HYPERMAP_MAP_WATCH_CARRY_OUT_H_
#define HYPERMAP_MAP_WATCH_CARRY_OUT_H_

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/snapshot.h"
#include "map/watch/map_change.h"

namespace hypermap {

// Returns `before` after the changes of a commit, as the snapshot of that `revision`. The changes
// must be as stored (WatchFilter::Frames::kAsStored). A subscriber begins by carrying out what the
// filter selects in a snapshot on an empty map:
//
//   SnapshotPtr copy = *CarryOut(empty_map, selection_revision, selection);
//   for (const Commit& commit : commits) copy = *CarryOut(*copy, commit.revision, commit.changes);
//
// Then `copy` has the frames of the map and the layers, objects and cells that the filter selects.
// It shares unchanged layers with the copy before.
//
// INVALID_ARGUMENT if a change lacks the content that its kind needs; errors of SnapshotEditor if
// one does not fit the map.
absl::StatusOr<SnapshotPtr> CarryOut(Snapshot before, Revision revision,
                                     absl::Span<const MapChange> changes);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_CARRY_OUT_H_
