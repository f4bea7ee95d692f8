// From one snapshot of a map to another, whatever lies between them.
#ifndef HYPERMAP_MAP_EDITS_DIFFERENCE_H_
#define HYPERMAP_MAP_EDITS_DIFFERENCE_H_

#include <vector>

#include "map/edits/change.h"
#include "map/snapshot.h"

namespace hypermap {

// What is not in `after` as it is in `before`, in an order in which it can be carried out. Objects
// and layers differ by their version as well. A layer whose kind, place or parameters other than
// aliases differ, or whose version went back, is another layer: deleted and created. Costs little
// where the two share content. Frames that only `before` places stay: there is no change that takes
// a frame back.
std::vector<Change> Difference(const Snapshot& before, const Snapshot& after);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_DIFFERENCE_H_
