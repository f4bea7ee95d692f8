// Applies edit batches to snapshots.
#ifndef HYPERMAP_MAP_EDITS_APPLY_H_
#define HYPERMAP_MAP_EDITS_APPLY_H_

#include "absl/status/statusor.h"
#include "base/limits/limits.h"
#include "map/edits/change.h"
#include "map/edits/edit.h"

namespace hypermap {

// Returns the snapshot after `batch`, with the next revision; `before` does not change. The error
// is that of the first edit that fails, with its index ("edits[3].object.label: ..."). Before any
// edit is applied, the cells of all of them are counted: RESOURCE_EXHAUSTED for more than
// limits.max_cells (map/edits/batch_cells.h). Errors of CheckCancelled, too. The cost is
// near-linear in the edits.
absl::StatusOr<AppliedBatch> Apply(const Snapshot& before, const EditBatch& batch,
                                   const Limits& limits = {});

// Likewise for a batch that Apply has accepted and the server has extended by edits of its own:
// limits.max_cells limits each edit alone.
absl::StatusOr<AppliedBatch> ApplyExtended(const Snapshot& before, const EditBatch& batch,
                                           const Limits& limits = {});

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_APPLY_H_
