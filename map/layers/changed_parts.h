// Where two versions of a grid differ.
#ifndef HYPERMAP_MAP_LAYERS_CHANGED_PARTS_H_
#define HYPERMAP_MAP_LAYERS_CHANGED_PARTS_H_

#include <vector>

#include "map/layers/grid_layer.h"

namespace hypermap {

// For each tile that has cells of `within` whose code is not as it was: the box around these cells.
// The two are of one geometry and domain. Versions share the tiles that were not written, so that
// it costs the tiles of `within` and the cells of those that were.
std::vector<CellBox> ChangedParts(const GridLayer& before, const GridLayer& after,
                                  const CellBox& within);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_CHANGED_PARTS_H_
