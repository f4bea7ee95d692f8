// A static index of boxes of all sizes, from a cup to a whole floor of a building.
#ifndef HYPERMAP_MAP_OBJECTS_BOX_GRID_H_
#define HYPERMAP_MAP_OBJECTS_BOX_GRID_H_

#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/types/span.h"
#include "map/objects/cell_level.h"

namespace hypermap {

// A hierarchy of grids: a box stands on a level whose cells are at least as large as it is. Sizes
// share a level as long as its cells stay short, so there are few levels, and a point looks at one
// cell of each. Immutable and safe to read from many threads.
class BoxGrid {
 public:
  BoxGrid() = default;
  // Boxes 0..n-1. Empty ones are left out.
  explicit BoxGrid(absl::Span<const Box> boxes);

  absl::Span<const CellLevel> levels() const { return levels_; }

  // Calls `visit` once with each box that may intersect `query`: a superset that the caller
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
