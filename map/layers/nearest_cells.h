// The cells of a grid that are nearest to a point. Private to this folder.
#ifndef HYPERMAP_MAP_LAYERS_NEAREST_CELLS_H_
#define HYPERMAP_MAP_LAYERS_NEAREST_CELLS_H_

#include <vector>

#include "map/geometry/point.h"
#include "map/grid/cell_domain.h"
#include "map/grid/grid_geometry.h"
#include "map/layers/grid_layer.h"

namespace hypermap {

// The distance between `p` (layer frame) and the centre of a cell. Grows with the differences of
// the coordinates, also where it rounds: a cell whose centre is at least as far from `p` along both
// axes is not nearer.
double DistanceToCentre(const GridGeometry& geometry, const CellIndex& cell, const Point& p);

// Returns the `k` matching cells whose centres are nearest to `p` (layer frame), nearest first;
// cells of the same distance by row and column. Reads only tiles that can hold one of them: where
// many cells have the same distance, because `p` is far away and distances round, those whose cells
// come first. If IsCancelled(), returns any cells.
std::vector<Neighbour> NearestCells(const GridLayer& layer, const Point& p,
                                    const CodePredicate& matches, int k);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_NEAREST_CELLS_H_
