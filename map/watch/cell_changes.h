// The cells that a write of a tile changed.
#ifndef HYPERMAP_MAP_WATCH_CELL_CHANGES_H_
#define HYPERMAP_MAP_WATCH_CELL_CHANGES_H_

#include <cstdint>
#include <vector>

#include "map/grid/cell_domain.h"
#include "map/grid/column_span.h"
#include "map/grid/tile.h"

namespace hypermap {

// The cells of a tile whose values differ, in runs by row and column: once with their values after
// the write, and once with those before it.
struct CellChanges {
  std::vector<CellRun> after;
  std::vector<CellRun> before;
};

// Finds the cells of a tile whose values differ. Compares one row at a time, so that the caller can
// pause between two rows. Used by one thread at a time.
class TileComparison {
 public:
  // Compares the cells in `within` only. `before` and `after` may be null, which stands for a tile
  // of unknown cells. The tiles and the domain must outlive this.
  TileComparison(const TileIndex& index, const Tile* before, const Tile* after,
                 const CellDomain* domain, const CellBox& within = kAllCells);

  bool done() const { return row_ == box_.row_end; }
  // The row that is compared next.
  int32_t row() const { return row_; }
  // Compares the cells of row() in `spans`, which must be sorted and disjoint, and goes on to the
  // next row. REQUIRES: !done().
  void CompareRow(const ColumnSpans& spans);

  // Returns the cells that differ in the rows so far.
  CellChanges Take() &&;

 private:
  // Collects cells, given by row and column, as runs of equal values.
  struct Runs {
    std::vector<CellRun> runs;
    CellCode last = kUnknownCode;  // Code of the last run.

    void Add(int32_t row, int32_t col, CellCode code, const CellDomain& domain);
  };

  CellCode CodeIn(const Tile* tile, int32_t col) const;

  TileIndex index_;
  const Tile* before_;
  const Tile* after_;
  const CellDomain* domain_;
  CellBox box_;
  int32_t row_;
  Runs runs_before_;
  Runs runs_after_;
};

// Returns the cells of a tile whose values differ. The arguments are those of TileComparison.
CellChanges ChangedCells(const TileIndex& index, const Tile* before, const Tile* after,
                         const CellDomain& domain);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_CELL_CHANGES_H_
