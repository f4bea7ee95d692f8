// The rules by which a polygon selects cells.
#ifndef HYPERMAP_MAP_GRID_CELL_RULE_H_
#define HYPERMAP_MAP_GRID_CELL_RULE_H_

namespace hypermap {

enum class CellRule {
  kCentre,   // The polygon covers the cell's centre.
  kCovered,  // The polygon covers the whole closed square of the cell.
  kTouched,  // The polygon and the closed square of the cell share a point.
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_CELL_RULE_H_
