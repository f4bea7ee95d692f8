// Counts the layers that a batch of edits names and creates, before any of them is applied.
#ifndef HYPERMAP_MAP_EDITS_BATCH_LAYERS_H_
#define HYPERMAP_MAP_EDITS_BATCH_LAYERS_H_

#include "absl/status/status.h"
#include "map/edits/edit.h"
#include "map/snapshot.h"

namespace hypermap {

// RESOURCE_EXHAUSTED, with the index of the edit, if a batch creates a layer while the map has
// `max_layers` layers, or creates more than `max_layers` layers although it deletes some of them
// again: each creation and deletion takes time in proportion to the layers that the map has. A map
// that has more layers already stays as it is. Edits that can't be applied are not counted: Apply
// refuses them. Also if `if_layers` names more than `max_layers` layers. Linear in the edits.
absl::Status CheckLayers(const Snapshot& before, const EditBatch& batch, int max_layers);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_BATCH_LAYERS_H_
