#include "map/grid/cell_cover.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "base/cancellation/cancellation.h"
#include "map/geometry/predicates.h"

namespace hypermap {
namespace {

bool IsTurned(const GridGeometry& geometry) { return geometry.layer_from_grid.yaw() != 0.0; }

// Returns `p` in units in which cell (r, c) is the unit square at (c, r).
Point InCells(const Point& p, const GridGeometry& geometry) {
  const Point in_grid = geometry.layer_from_grid.ApplyInverse(p);
  return {in_grid.x / geometry.resolution_m, in_grid.y / geometry.resolution_m};
}

Polygon InCells(const Polygon& polygon, const GridGeometry& geometry) {
  Rings rings = polygon.rings();
  for (Ring& ring : rings) {
    for (Point& p : ring) p = InCells(p, geometry);
  }
  return Polygon::MakeUnchecked(std::move(rings));
}

// Bounds, in cells, the rounding of the polygon's vertices and of nearby centres and corners of
// cells when they are transformed between the layer's frame and the grid's axes. Each takes a
// handful of operations on numbers no larger than `reach`.
double RoundingInCells(const Polygon& polygon, const GridGeometry& geometry) {
  if (polygon.empty()) return 0.0;
  const Box& b = polygon.bounds();
  const double reach = std::max(std::abs(b.min.x), std::abs(b.max.x)) +
                       std::max(std::abs(b.min.y), std::abs(b.max.y)) +
                       std::abs(geometry.layer_from_grid.x()) +
                       std::abs(geometry.layer_from_grid.y()) + geometry.resolution_m;
  return 64.0 * std::numeric_limits<double>::epsilon() * reach / geometry.resolution_m;
}

// Clamps `low` and `high`, which may be any doubles, to indices from `begin` to `end`. Two times
// the same index if one of them is NaN.
std::pair<int32_t, int32_t> ClampIndices(double low, double high, int32_t begin, int32_t end) {
  if (std::isnan(low) || std::isnan(high)) return {begin, begin};
  return {static_cast<int32_t>(std::clamp<double>(low, begin, end)),
          static_cast<int32_t>(std::clamp<double>(high, begin, end))};
}

// Beyond this rounding, the positions of a polygon and turned cells mean nothing. GEOS must not be
// asked then: it leaks memory when numbers overflow.
constexpr double kMaxRoundingInCells = 1e6;

// Returns the cells of `within` that are near the polygon. None if numbers are too large to tell.
CellBox CellsNear(const Polygon& polygon, const GridGeometry& geometry, double rounding,
                  const CellBox& within) {
  if (polygon.empty() || within.empty()) return CellBox();
  if (IsTurned(geometry) && !(rounding < kMaxRoundingInCells)) return CellBox();
  Box b;
  for (const Ring& ring : polygon.rings()) {
    for (const Point& p : ring) {
      const Point in_cells = InCells(p, geometry);
      if (std::isnan(in_cells.x) || std::isnan(in_cells.y)) return CellBox();
      b.Extend(in_cells);
    }
  }
  // A polygon may touch a cell from the outside, along the cell's edge.
  const double margin = 1.0 + rounding;
  CellBox near;
  std::tie(near.row_begin, near.row_end) =
      ClampIndices(std::floor(b.min.y - margin), std::floor(b.max.y + margin) + 1.0,
                   within.row_begin, within.row_end);
  std::tie(near.col_begin, near.col_end) =
      ClampIndices(std::floor(b.min.x - margin), std::floor(b.max.x + margin) + 1.0,
                   within.col_begin, within.col_end);
  return near.empty() ? CellBox() : near;
}

// Returns what RowScan needs of the polygon, in its units.
Polygon PolygonToScan(const Polygon& polygon, const GridGeometry& geometry, const CellBox& bounds) {
  if (bounds.empty()) return Polygon();
  return IsTurned(geometry) ? InCells(polygon, geometry) : polygon;
}

}  // namespace

CellCover::CellCover(const Polygon& polygon, const GridGeometry& geometry, const CellBox& within,
                     CellRule rule)
    : geometry_(geometry),
      rule_(rule),
      polygon_(IsTurned(geometry) ? polygon : Polygon()),
      rounding_(RoundingInCells(polygon, geometry)),
      bounds_(CellsNear(polygon, geometry, rounding_, within)),
      scan_(PolygonToScan(polygon, geometry, bounds_), bounds_.col_begin, bounds_.col_end) {}

CellBox CellCover::BoundsOf(const Polygon& polygon, const GridGeometry& geometry,
                            const CellBox& within) {
  return CellsNear(polygon, geometry, RoundingInCells(polygon, geometry), within);
}

ColumnSpans CellCover::SpansOfRow(int32_t row) const {
  if (row < bounds_.row_begin || row >= bounds_.row_end) return {};
  if (IsTurned(geometry_)) return SpansOfTurnedRow(row);
  const Lattice lattice = CentresOrSquares();
  return rule_ == CellRule::kCovered ? scan_.Covered(lattice, row) : scan_.Touched(lattice, row);
}

int32_t CellCover::EndOfLikeRows(int32_t row) const {
  if (row < bounds_.row_begin) return bounds_.row_begin;
  if (row >= bounds_.row_end) return std::numeric_limits<int32_t>::max();
  if (IsTurned(geometry_) || rule_ != CellRule::kCentre) return row + 1;
  return std::min(scan_.EndOfLikeRows(CentresOrSquares(), row), bounds_.row_end);
}

Lattice CellCover::CentresOrSquares() const {
  Lattice lattice{{geometry_.layer_from_grid.x(), geometry_.layer_from_grid.y()},
                  geometry_.resolution_m};
  if (rule_ == CellRule::kCentre) lattice.low = lattice.high = 0.5;
  return lattice;
}

ColumnSpans CellCover::SpansOfTurnedRow(int32_t row) const {
  // Each cell is tested once grown and once shrunk by the rounding. Where both tests agree, the
  // answer is certain; the other cells are tested exactly. The rounding is capped, because beyond a
  // quarter of a cell the position of a cell means little.
  const double r = std::min(rounding_, 0.25);
  ColumnSpans possible, certain;
  switch (rule_) {
    case CellRule::kCentre: {
      const Lattice centres{{}, 1.0, 0.5 - r, 0.5 + r};
      possible = scan_.Touched(centres, row);
      certain = scan_.Covered(centres, row);
      break;
    }
    case CellRule::kTouched:
      possible = scan_.Touched({{}, 1.0, -r, 1.0 + r}, row);
      certain = scan_.Touched({{}, 1.0, r, 1.0 - r}, row);
      break;
    case CellRule::kCovered:
      possible = scan_.Covered({{}, 1.0, r, 1.0 - r}, row);
      certain = scan_.Covered({{}, 1.0, -r, 1.0 + r}, row);
      break;
  }
  for (const ColumnSpan& span : Difference(possible, certain)) {
    for (int32_t col = span.col_begin; col < span.col_end; ++col) {
      // The exact test takes long if the polygon has many vertices.
      if (IsCancelled()) return certain;
      if (Selected({row, col})) certain.push_back({col, col + 1});
    }
  }
  return Union(std::move(certain));
}

bool CellCover::Selected(const CellIndex& cell) const {
  if (rule_ == CellRule::kCentre) return Covers(polygon_, geometry_.CentreOf(cell));
  const Polygon square = geometry_.SquareOf(cell);
  if (rule_ == CellRule::kTouched) return PreparedPolygon(square).Intersects(polygon_);
  return PreparedPolygon(polygon_).Covers(square);
}

}  // namespace hypermap
