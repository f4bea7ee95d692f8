// Draws a map: its layers on top of each other, as in the figures of the Hypermap paper.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_MAP_IMAGE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_MAP_IMAGE_H_

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_libs/cli/map_scene.h"
#include "map/grid/grid_geometry.h"

namespace hypermap::cli {

struct MapImage {
  std::string png;
  int width = 0;
  int height = 0;
};

using DrawRun = std::function<void(const GridGeometry& geometry, const CellRun& run)>;
// Passes all runs of a grid layer to `draw`, in the frame of the scene.
using ReadCells = std::function<absl::Status(const std::string& layer, const DrawRun& draw)>;

// Draws, from bottom to top: floors in grey (free is light, occupied is dark); tints of other grids
// by value; shade over unexplored area; objects in the colour of their class, paler if their
// existence is uncertain (polygons filled, line strings stroked, points as discs); borders of
// explorations; goals and paths of robots. Adds a legend and a scale. North (y) is up. Cells are
// drawn as they arrive and are not kept. Errors are those of `read_cells`.
absl::StatusOr<MapImage> DrawMap(const MapScene& scene, const ReadCells& read_cells);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_MAP_IMAGE_H_
