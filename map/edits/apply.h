// Applies edit batches to snapshots.
#ifndef HYPERMAP_MAP_EDITS_APPLY_H_
#define HYPERMAP_MAP_EDITS_APPLY_H_

#include "absl/status/statusor.h"
#include "base/limits/limits.h"
#include "map/edits/change.h"
#include "map/edits/edit.h"

namespace hypermap {

// Returns the snapshot after `batch`, with the next revision; `before` does not change. The error
// is that of the first edit that fails, with its index ("edits[3].object.label: ...");
// RESOURCE_EXHAUSTED for a fill of more than limits.max_cells.
absl::StatusOr<AppliedBatch> Apply(const Snapshot& before, const EditBatch& batch,
                                   const Limits& limits = {});

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_APPLY_H_
