// A map without its content: frames, and layers that are empty but have their spec, and grids their
// extent. Small, so that it can be kept for each of many revisions.
#ifndef HYPERMAP_MAP_WATCH_STRUCTURE_H_
#define HYPERMAP_MAP_WATCH_STRUCTURE_H_

#include <vector>

#include "map/edits/change.h"
#include "map/snapshot.h"

namespace hypermap {

// The structure of `snapshot`. Its revision and versions are the snapshot's.
SnapshotPtr StructureOf(const Snapshot& snapshot);

// The structure after a commit: the same pointer when the commit changed content only. So its
// revision is that of the last commit that changed it, and versions are not kept up.
SnapshotPtr StructureAfter(const SnapshotPtr& before, Revision revision,
                           const std::vector<Change>& changes);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_STRUCTURE_H_
