// Frontiers: the borders between explored and unexplored floor.
#ifndef HYPERMAP_MAP_EXPLORATION_FRONTIERS_H_
#define HYPERMAP_MAP_EXPLORATION_FRONTIERS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "map/exploration/cell_raster.h"

namespace hypermap {

// The state of a cell in an exploration.
enum class Coverage : uint8_t {
  kNone,        // Nothing to explore: no floor, or outside the area.
  kUnexplored,  // Floor of the area that was not seen yet.
  kExplored,
};
using CoverageRaster = CellRaster<Coverage>;

// Connected cells, sorted by row, then column.
using Frontier = std::vector<CellIndex>;

// Unexplored cells beside explored ones (Yamauchi, "A frontier-based approach for autonomous
// exploration", CIRA 1997), connected by sides or corners. An update costs as much as the cells
// that changed and the frontiers that they touch, which keeps large sites cheap. Not thread-safe.
class Frontiers {
 public:
  Frontiers() = default;
  // If the work of this thread is cancelled, some frontiers may be missing.
  explicit Frontiers(const CoverageRaster& coverage);

  // Must not be cancelled. `changed` must contain all cells of `coverage` that changed, and may
  // contain others.
  void Update(const CoverageRaster& coverage, const std::vector<CellIndex>& changed);

  // Sorted by their first cells. Frontiers have different first cells.
  std::vector<Frontier> All() const;
  size_t size() const { return frontiers_.size(); }
  // Number of cells that the last update visited.
  int64_t last_work() const { return last_work_; }

 private:
  using Number = int32_t;

  static bool IsFrontier(const CoverageRaster& coverage, const CellIndex& cell);
  // Dissolves a frontier, and appends its cells to `cells`.
  void TakeApart(Number number, std::vector<CellIndex>* cells);
  // Builds frontiers from cells that are not in one.
  void Join(const std::vector<CellIndex>& cells);

  absl::flat_hash_map<Number, Frontier> frontiers_;
  absl::flat_hash_map<CellIndex, Number, CellHash> frontier_of_;  // 0: not joined yet.
  Number next_number_ = 1;
  int64_t last_work_ = 0;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_FRONTIERS_H_
