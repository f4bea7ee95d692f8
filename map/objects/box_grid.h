// A static index of boxes of all sizes, from a cup to a whole floor of a building.
#ifndef HYPERMAP_MAP_OBJECTS_BOX_GRID_H_
#define HYPERMAP_MAP_OBJECTS_BOX_GRID_H_

#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/types/span.h"
#include "map/objects/cell_level.h"

namespace hypermap {

// A hierarchy of grids. Each box is on a level whose cells are at least as large as the box. Sizes
// share a level as long as its cells hold few boxes, so that there are few levels, and a point
// reads one cell of each. Immutable; safe to read from many threads.
class BoxGrid {
 public:
  BoxGrid() = default;
  // Indexes boxes 0..n-1. Empty ones are left out.
  explicit BoxGrid(absl::Span<const Box> boxes);

  absl::Span<const CellLevel> levels() const { return levels_; }

  // Calls `visit` once with each box that may intersect `query`: a superset, which the caller
  // refines.
  void Visit(const Box& query, absl::FunctionRef<void(int)> visit) const {
    for (const CellLevel& level : levels_) level.Visit(query, visit);
  }

 private:
  void AddLevelOfAll(absl::Span<const Box> boxes);

  std::vector<CellLevel> levels_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBJECTS_BOX_GRID_H_
