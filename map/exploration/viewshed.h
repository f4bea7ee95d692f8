// Viewsheds of a floor plan: the cells that are visible from a cell.
#ifndef HYPERMAP_MAP_EXPLORATION_VIEWSHED_H_
#define HYPERMAP_MAP_EXPLORATION_VIEWSHED_H_

#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "map/exploration/floor_plan.h"

namespace hypermap {

// Returns whether the straight line between the centres of two cells passes only through free
// cells, including the two. Where it passes through a corner, both cells beside the corner must be
// free. Symmetric.
bool HasLineOfSight(const FloorPlan& plan, const CellIndex& a, const CellIndex& b);

// The rays that determine viewsheds of one range. Building them takes much longer than using them,
// so build them once for many viewsheds. Memory is proportional to the square of the range.
class ViewshedRays {
 public:
  // `range` is in cells, >= 1.
  explicit ViewshedRays(int32_t range);

  // Calls `visit` once for each free cell within the range (exclusive, from centre to centre) that
  // a ray from `from` reaches before it hits a cell that is not free; `from` comes first. Rays lead
  // from the centre of `from` to the centres of all cells on the border of the range. Visits
  // nothing if `from` is not free.
  void ForEachVisible(const FloorPlan& plan, const CellIndex& from,
                      absl::FunctionRef<void(const CellIndex&)> visit);

 private:
  struct Step {
    int32_t row, col;  // Offset of a cell from the start of the rays.
    int32_t skip;      // Index of the first step that does not pass through this cell.
  };

  int32_t range_;
  // The rays as a prefix tree in depth-first order: the part that rays have in common is walked
  // once, and an obstacle skips its whole subtree.
  std::vector<Step> steps_;
  std::vector<uint32_t> seen_;  // By offset: number of the last viewshed that had the cell.
  uint32_t viewshed_ = 0;       // Number of the current viewshed.
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_VIEWSHED_H_
