// Applies edit batches to snapshots.
#ifndef HYPERMAP_MAP_EDITS_APPLY_H_
#define HYPERMAP_MAP_EDITS_APPLY_H_

#include <cstdint>
#include <limits>

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
//
// RESOURCE_EXHAUSTED, too, as soon as the tiles take more than `max_growth` bytes of memory more
// than before the batch, so that a batch that may not be committed does not take them all. What it
// adds besides tiles is for the caller to count (map/content_bytes.h).
inline constexpr int64_t kAnyGrowth = std::numeric_limits<int64_t>::max();
absl::StatusOr<AppliedBatch> Apply(const Snapshot& before, const EditBatch& batch,
                                   const Limits& limits = {}, int64_t max_growth = kAnyGrowth);

// Likewise for a batch that Apply has accepted and the server has extended by edits of its own:
// limits.max_cells limits each edit alone.
absl::StatusOr<AppliedBatch> ApplyExtended(const Snapshot& before, const EditBatch& batch,
                                           const Limits& limits = {},
                                           int64_t max_growth = kAnyGrowth);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_APPLY_H_
