// The evidence about a thing's footprint, cell by cell.
#ifndef HYPERMAP_MAP_FUSION_SHAPE_GRID_H_
#define HYPERMAP_MAP_FUSION_SHAPE_GRID_H_

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/functional/function_ref.h"
#include "map/geometry/polygon.h"
#include "map/grid/grid_geometry.h"
#include "map/observations/observation.h"

namespace hypermap::fusion {

// Evidence for and against each cell of a box that grows on demand. Cell (row, col) covers [col,
// col + 1) x [row, row + 1) times the resolution, in the layer's frame. A value; a copy costs
// little until it is changed.
class ShapeGrid {
 public:
  ShapeGrid() = default;
  explicit ShapeGrid(double resolution_m) : resolution_m_(resolution_m) {}

  double resolution_m() const { return resolution_m_; }
  const CellBox& box() const { return box_; }
  Point CentreOf(const CellIndex& cell) const {
    return {(cell.col + 0.5) * resolution_m_, (cell.row + 0.5) * resolution_m_};
  }

  void AddHit(const CellIndex& cell, float weight) {
    const size_t i = Grown(cell);
    Own().hit[i] += weight;
  }
  // Adds hits to the cells [col_begin, col_end) of a row. REQUIRES: they are in the box.
  void AddHits(int32_t row, int32_t col_begin, int32_t col_end, float weight);
  // Ignores cells outside the box.
  void AddMiss(const CellIndex& cell, float weight);

  float hit(const CellIndex& cell) const { return box_.Contains(cell) ? hits()[At(cell)] : 0.0f; }
  float miss(const CellIndex& cell) const {
    return box_.Contains(cell) ? misses()[At(cell)] : 0.0f;
  }
  // Returns hit / (hit + miss + doubt), in [0, 1]; 0 outside the box.
  double Occupancy(const CellIndex& cell, double doubt) const;

  // Grows the box to include `box`, so that adding many cells copies the grid only once.
  void Reserve(const CellBox& box);

  // Adds the evidence of another grid, which may have another resolution.
  void Absorb(const ShapeGrid& other);
  // Returns the same evidence in cells of another size (nearest neighbour).
  ShapeGrid Resampled(double resolution_m) const;

  // Returns the convex hull of the largest connected set of cells (8 neighbours) with an occupancy
  // above `threshold`, given `doubt`. Smaller sets are usually errors of masks. Empty if there is
  // no such cell.
  Polygon Hull(double threshold, double doubt) const;

  friend bool operator==(const ShapeGrid& a, const ShapeGrid& b) {
    return a.resolution_m_ == b.resolution_m_ && a.box_ == b.box_ && *a.cells_ == *b.cells_;
  }

  // The raw evidence, row-major over box(), for codecs.
  const std::vector<float>& hits() const { return cells_->hit; }
  const std::vector<float>& misses() const { return cells_->miss; }
  // Bytes of memory of the evidence, and whether it shares them with another grid.
  int64_t bytes() const {
    return static_cast<int64_t>((hits().capacity() + misses().capacity()) * sizeof(float));
  }
  bool SharesCellsWith(const ShapeGrid& other) const { return cells_ == other.cells_; }
  static ShapeGrid FromRaw(double resolution_m, const CellBox& box, std::vector<float> hits,
                           std::vector<float> misses);

 private:
  size_t At(const CellIndex& c) const {
    return static_cast<size_t>(c.row - box_.row_begin) * static_cast<size_t>(box_.cols()) +
           static_cast<size_t>(c.col - box_.col_begin);
  }
  size_t Grown(const CellIndex& cell);
  // The cells of the largest connected set, the first one of several, row by row; rows and columns
  // count from the first of the box.
  std::vector<CellSpan> LargestPart(double threshold, double doubt) const;

  struct Cells {
    std::vector<float> hit;
    std::vector<float> miss;
    friend bool operator==(const Cells&, const Cells&) = default;
  };
  static std::shared_ptr<Cells> NoCells();
  // The cells, of which no copy of this grid has a part from now on.
  Cells& Own() {
    if (cells_.use_count() > 1) cells_ = std::make_shared<Cells>(*cells_);
    return *cells_;
  }

  double resolution_m_ = 0.01;
  CellBox box_;
  // Never null. Copies share them until one of them changes.
  std::shared_ptr<Cells> cells_ = NoCells();
};

// Returns the length of the longer side of a box, which must not be empty.
inline double LongerSide(const Box& box) {
  return std::max(box.max.x - box.min.x, box.max.y - box.min.y);
}

// Calls `visit(row, col_begin, col_end)`, row by row, for the cells whose centres the convex
// polygon covers. Cells are numbered as in ShapeGrid.
void ForEachSpan(const Polygon& convex, double resolution_m,
                 absl::FunctionRef<void(int32_t, int32_t, int32_t)> visit);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_SHAPE_GRID_H_
