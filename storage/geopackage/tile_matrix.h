// The places of a grid's tiles in the tile matrix of its table.
//
// GeoPackage counts tiles from the upper left corner of a matrix of fixed size. Ours has room for
// all cells that a grid may have, and its middle is the grid's origin, so that a grid can grow in
// every direction without moving stored tiles. Coordinates are those of the grid's own axes: x =
// origin.x + col * resolution, y = origin.y + row * resolution. The yaw of the origin is left out,
// because a GeoPackage has no turned grids.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TILE_MATRIX_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TILE_MATRIX_H_

#include <cstdint>

#include "map/geometry/point.h"
#include "map/grid/grid_geometry.h"
#include "map/grid/tile.h"

namespace hypermap::storage {

inline constexpr int kZoomLevel = 0;
// Tiles along a side of the matrix.
inline constexpr int32_t kTileMatrixSide = 2 * (kMaxCellIndex / kTileSide);

// A tile's place in the matrix: columns to the right, rows down.
struct MatrixTile {
  int64_t column = 0;
  int64_t row = 0;
};

inline MatrixTile ToMatrix(const TileIndex& tile) {
  return {int64_t{tile.col} + kTileMatrixSide / 2, kTileMatrixSide / 2 - 1 - int64_t{tile.row}};
}

inline bool IsInMatrix(const MatrixTile& tile) {
  return tile.column >= 0 && tile.column < kTileMatrixSide && tile.row >= 0 &&
         tile.row < kTileMatrixSide;
}

// REQUIRES: IsInMatrix(tile).
inline TileIndex FromMatrix(const MatrixTile& tile) {
  return {static_cast<int32_t>(kTileMatrixSide / 2 - 1 - tile.row),
          static_cast<int32_t>(tile.column - kTileMatrixSide / 2)};
}

// The box of the cells in the grid's own axes; empty when there are no cells.
inline Box BoundsInOwnAxes(const GridGeometry& geometry, const CellBox& cells) {
  if (cells.empty()) return Box();
  const PlanarTransform& origin = geometry.layer_from_grid;
  const double side_m = geometry.resolution_m;
  return {{origin.x() + cells.col_begin * side_m, origin.y() + cells.row_begin * side_m},
          {origin.x() + cells.col_end * side_m, origin.y() + cells.row_end * side_m}};
}

inline Box TileMatrixBounds(const GridGeometry& geometry) {
  return BoundsInOwnAxes(geometry, kAllCells);
}

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TILE_MATRIX_H_
