// The difference of two snapshots of a map, whatever happened between them.
#ifndef HYPERMAP_MAP_EDITS_DIFFERENCE_H_
#define HYPERMAP_MAP_EDITS_DIFFERENCE_H_

#include <vector>

#include "map/edits/change.h"
#include "map/snapshot.h"

namespace hypermap {

// Returns the changes that turn `before` into `after`, in an order in which they can be applied.
// The versions of objects and layers are compared, too. A layer whose kind, frame, grid or
// parameters (except aliases) differ, or whose version decreased, is a different layer: it is
// deleted and created. Cheap for content that the snapshots share. Frames that only `before` knows
// remain, because no change removes a frame.
std::vector<Change> Difference(const Snapshot& before, const Snapshot& after);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_DIFFERENCE_H_
