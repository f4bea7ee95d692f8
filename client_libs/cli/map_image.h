// A picture of a map: its layers on top of each other, as the Hypermap paper shows them.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_MAP_IMAGE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_MAP_IMAGE_H_

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/geometry/point.h"
#include "map/geometry/polygon.h"
#include "map/layers/grid/grid_geometry.h"
#include "map/layers/layer_spec.h"

namespace hypermap::cli {

// A grid layer apart from its cells.
struct GridScene {
  std::string layer;
  LayerKind kind = LayerKind::kOccupancy;
  // Of a scalar layer: the range of its values.
  double low = 0.0;
  double high = 0.0;
};

// An object as far as it is drawn.
struct Footprint {
  std::string label;
  double existence = 1.0;
  Polygon polygon;
};

// What is drawn. Coordinates are of one frame.
struct MapScene {
  std::string title;
  Box box;  // the part of the plane that is shown; must have an area
  double pixels_per_m = 1.0;
  std::optional<Polygon> area;  // whose border is drawn
  std::vector<GridScene> grids;
  std::vector<Footprint> objects;
};

struct MapImage {
  std::string png;
  int width = 0;
  int height = 0;
};

using DrawRun = std::function<void(const GridGeometry& geometry, const CellRun& run)>;
// Gives all runs of a grid layer to `draw`, in the frame of the scene.
using ReadCells = std::function<absl::Status(const std::string& layer, const DrawRun& draw)>;

// Occupancy in grey, free light and occupied dark; over it scalar layers, tinted by value;
// unexplored area darkened; objects in the colour of their class, faint where their existence is in
// doubt; a legend and a scale. North (y) is up. Cells are drawn as they come, none is kept. Errors
// are those of `read_cells`.
absl::StatusOr<MapImage> DrawMap(const MapScene& scene, const ReadCells& read_cells);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_MAP_IMAGE_H_
