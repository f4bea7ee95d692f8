// Where what has been seen ends.
#ifndef HYPERMAP_MAP_EXPLORATION_FRONTIERS_H_
#define HYPERMAP_MAP_EXPLORATION_FRONTIERS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "map/exploration/cell_raster.h"

namespace hypermap {

// What a cell is to an exploration.
enum class Coverage : uint8_t {
  kNone,        // nothing to be explored: no floor, or out of the area
  kUnexplored,  // floor of the area that nobody has seen yet
  kExplored,
};
using CoverageRaster = CellRaster<Coverage>;

// Cells that hang together; by row, then column.
using Frontier = std::vector<CellIndex>;

// Unexplored cells beside explored ones (Yamauchi, "A frontier-based approach for autonomous
// exploration", CIRA 1997), joined where they touch by a side or a corner. Kept up to date at the
// cost of what changes and of the frontiers that it touches. Not thread safe.
class Frontiers {
 public:
  Frontiers() = default;
  explicit Frontiers(const CoverageRaster& coverage);

  // `changed`: all cells of `coverage` that are not as they were, perhaps others too.
  void Update(const CoverageRaster& coverage, const std::vector<CellIndex>& changed);

  // By their first cells. The first cell tells a frontier from all others.
  std::vector<Frontier> All() const;
  size_t size() const { return frontiers_.size(); }
  // How many cells the last update looked at.
  int64_t last_work() const { return last_work_; }

 private:
  using Number = int32_t;

  static bool IsFrontier(const CoverageRaster& coverage, const CellIndex& cell);
  // Takes a frontier apart, into `cells`.
  void TakeApart(Number number, std::vector<CellIndex>* cells);
  // Joins cells that are frontier cells and in no frontier.
  void Join(const std::vector<CellIndex>& cells);

  absl::flat_hash_map<Number, Frontier> frontiers_;
  absl::flat_hash_map<CellIndex, Number, CellHash> frontier_of_;  // 0: not joined yet
  Number next_number_ = 1;
  int64_t last_work_ = 0;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_FRONTIERS_H_
