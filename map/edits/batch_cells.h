// Counts the cells that a batch of edits sets, before any of them is applied.
#ifndef HYPERMAP_MAP_EDITS_BATCH_CELLS_H_
#define HYPERMAP_MAP_EDITS_BATCH_CELLS_H_

#include <cstdint>

#include "absl/status/status.h"
#include "map/edits/edit.h"
#include "map/snapshot.h"

namespace hypermap {

// The number of tiles that a batch may write if it may set `max_cells` cells: room for twice as
// many cells, since areas need not begin and end where tiles do, and for small limits.
int64_t MaxTiles(int64_t max_cells);

// RESOURCE_EXHAUSTED, with the index of the edit, if the edits of the batch together set more than
// `max_cells` cells, where a filled polygon counts as its box of cells, or write more than
// MaxTiles(max_cells) tiles, each of which is copied. Edits that can't be applied, such as those of
// layers that are not there, are not counted: Apply refuses them. Allocates nothing for the cells.
// Errors of CheckCancelled. Linear in the edits, their vertices and the tiles that they write.
absl::Status CheckCells(const Snapshot& before, const EditBatch& batch, int64_t max_cells);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_BATCH_CELLS_H_
