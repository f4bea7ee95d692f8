// When a cell counts as selected by a polygon.
#ifndef HYPERMAP_MAP_GRID_CELL_RULE_H_
#define HYPERMAP_MAP_GRID_CELL_RULE_H_

namespace hypermap {

enum class CellRule {
  kCentre,   // its centre is covered
  kCovered,  // all of the closed cell square is covered
  kTouched,  // the closed cell square and the polygon share a point
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_CELL_RULE_H_
