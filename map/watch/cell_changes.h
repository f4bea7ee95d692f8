// What writing a tile changed.
#ifndef HYPERMAP_MAP_WATCH_CELL_CHANGES_H_
#define HYPERMAP_MAP_WATCH_CELL_CHANGES_H_

#include <vector>

#include "map/grid/cell_cover.h"
#include "map/grid/cell_domain.h"
#include "map/grid/tile.h"

namespace hypermap {

// Runs of the cells of a tile whose value is not as it was, by row and column: with the value
// after, and the same cells with the value before.
struct CellChanges {
  std::vector<CellRun> after;
  std::vector<CellRun> before;
};

// `before` and `after` may be null: no tile, all unknown. With a `cover` only the cells it selects.
CellChanges ChangedCells(const TileIndex& index, const Tile* before, const Tile* after,
                         const CellDomain& domain, const CellCover* cover);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_CELL_CHANGES_H_
