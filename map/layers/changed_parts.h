// Finds the cells in which two versions of a grid differ.
#ifndef HYPERMAP_MAP_LAYERS_CHANGED_PARTS_H_
#define HYPERMAP_MAP_LAYERS_CHANGED_PARTS_H_

#include <vector>

#include "map/layers/grid_layer.h"

namespace hypermap {

// Returns, for each tile with cells of `within` whose codes differ, the box around these cells.
// Both grids must have the same geometry and domain. Versions share tiles that were not written, so
// that the cost is one step for each tile of `within`, plus the cells of tiles that were written.
// Only some of the boxes if the work is cancelled.
std::vector<CellBox> ChangedParts(const GridLayer& before, const GridLayer& after,
                                  const CellBox& within);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_CHANGED_PARTS_H_
