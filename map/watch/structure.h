// Keeps the structure of a map up to date, commit by commit.
#ifndef HYPERMAP_MAP_WATCH_STRUCTURE_H_
#define HYPERMAP_MAP_WATCH_STRUCTURE_H_

#include <vector>

#include "map/edits/change.h"
#include "map/structure.h"

namespace hypermap {

// Returns the structure after a commit. It shares with `before` all frames, layers and aliases that
// the commit does not name. If the commit changed content only, this is `before`
// itself; hence the revision of a structure is that of the last commit that changed it.
StructurePtr StructureAfter(const StructurePtr& before, Revision revision,
                            const std::vector<Change>& changes);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_STRUCTURE_H_
