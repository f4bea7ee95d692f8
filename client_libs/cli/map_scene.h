// What there is to be drawn of a map.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_MAP_SCENE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_MAP_SCENE_H_

#include <optional>
#include <string>
#include <vector>

#include "client_libs/cli/robot_paths.h"
#include "map/geometry/point.h"
#include "map/geometry/polygon.h"
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

// An area that is explored. Its floor is unexplored where the layer does not say otherwise.
struct ExplorationScene {
  Polygon area;
  std::string layer;  // empty: not drawn
};

// Where a robot is on the way to.
struct GoalMarker {
  std::string robot;  // empty: not known
  Point at;
};

// What is drawn. Coordinates are of one frame.
struct MapScene {
  std::string title;
  Box box;  // the part of the plane that is shown; must have an area
  double pixels_per_m = 1.0;
  std::optional<Polygon> area;  // whose border is drawn
  std::vector<GridScene> grids;
  std::vector<Footprint> objects;
  std::vector<ExplorationScene> explorations;
  std::vector<GoalMarker> goals;
  std::vector<Point> unreachable_places;
  std::vector<RobotPath> paths;
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_MAP_SCENE_H_
