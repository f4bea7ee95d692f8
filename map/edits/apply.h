// Applies edit batches to snapshots.
#ifndef HYPERMAP_MAP_EDITS_APPLY_H_
#define HYPERMAP_MAP_EDITS_APPLY_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "map/edits/change.h"
#include "map/edits/edit.h"

namespace hypermap {

struct EditLimits {
  int64_t max_cells_per_fill = int64_t{1} << 28;
};

// Returns the snapshot after `batch`, with the next revision; `before` does not change. The error
// is that of the first edit that fails, with its index ("edits[3].object.label: ...").
absl::StatusOr<AppliedBatch> Apply(const Snapshot& before, const EditBatch& batch,
                                   const EditLimits& limits = {});

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_APPLY_H_
