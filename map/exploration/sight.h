// What can be seen from a place.
#ifndef HYPERMAP_MAP_EXPLORATION_SIGHT_H_
#define HYPERMAP_MAP_EXPLORATION_SIGHT_H_

#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "map/exploration/floor_plan.h"

namespace hypermap {

// Whether the straight line between the centres of two cells goes through free cells only, the two
// included. Where it goes through a corner, both cells beside the corner must be free. Symmetric.
bool InSight(const FloorPlan& plan, const CellIndex& a, const CellIndex& b);

// Casts rays to look round from a cell, over and over. Keeps what it needs for one range, which
// grows with the range's square.
class Sight {
 public:
  // `range` in cells, >= 1.
  explicit Sight(int32_t range);

  // Calls `visit` once with each free cell, nearer than the range by their centres, that a ray from
  // `from` meets before it meets a cell that is not free; `from` first. Rays go from its centre to
  // the centres of all cells at the rim of the range. Nothing when `from` is not free.
  void Look(const FloorPlan& plan, const CellIndex& from,
            absl::FunctionRef<void(const CellIndex&)> visit);

 private:
  struct Step {
    int32_t row, col;  // of a cell, from where the rays begin
    int32_t skip;      // to the first step that does not go through this cell
  };

  int32_t range_;
  // The rays as a tree, depth first: what two rays have in common is walked once.
  std::vector<Step> steps_;
  std::vector<uint32_t> seen_;  // by offset: the look that met the cell
  uint32_t look_ = 0;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_SIGHT_H_
