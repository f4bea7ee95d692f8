// The cells that a write of a tile changed.
#ifndef HYPERMAP_MAP_WATCH_CELL_CHANGES_H_
#define HYPERMAP_MAP_WATCH_CELL_CHANGES_H_

#include <vector>

#include "map/grid/cell_cover.h"
#include "map/grid/cell_domain.h"
#include "map/grid/tile.h"

namespace hypermap {

// The cells of a tile whose values differ, in runs by row and column: once with their values after
// the write, and once with those before it.
struct CellChanges {
  std::vector<CellRun> after;
  std::vector<CellRun> before;
};

// Returns the cells whose values differ; with a `cover`, only those that it selects. `before` and
// `after` may be null, which stands for a tile of unknown cells.
CellChanges ChangedCells(const TileIndex& index, const Tile* before, const Tile* after,
                         const CellDomain& domain, const CellCover* cover);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_CELL_CHANGES_H_
