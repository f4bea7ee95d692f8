// The parts of a map's picture, as values.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_MAP_SCENE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_MAP_SCENE_H_

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "client_libs/cli/robot_paths.h"
#include "map/geometry/point.h"
#include "map/geometry/polygon.h"
#include "map/geometry/shape.h"

namespace hypermap::cli {

// How the cells of a grid are drawn.
enum class GridStyle {
  // Grey, from light at `low` (free) to dark at `high` (occupied); below all other grids.
  kFloor,
  // Two values: cells at `low` darken the picture below, those at `high` leave it as it is.
  kShade,
  // A tint over the picture below, from faint at `low` to strong at `high`.
  kTint,
};

// A grid layer without its cells.
struct GridScene {
  std::string layer;
  GridStyle style = GridStyle::kTint;
  // The values that have the colours of the two ends, and their names in the legend.
  double low = 0.0;
  double high = 1.0;
  std::string low_name;
  std::string high_name;

  // 0 at `low`, 1 at `high`.
  double ShareOf(double value) const {
    return high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0.0;
  }
};

// The members of an object that are drawn.
struct DrawnObject {
  std::string label;
  double existence = 1.0;
  Shape shape;
};

// An area that robots explore. Its floor counts as unexplored where the layer says nothing.
struct ExplorationScene {
  Polygon area;
  std::string layer;  // empty: not drawn
};

// The place that a robot drives to.
struct GoalMarker {
  std::string robot;  // empty: not known
  Point at;
};

// All that is drawn, in the coordinates of one frame.
struct MapScene {
  std::string title;
  Box box;  // the part of the plane that is shown; must have an area
  double pixels_per_m = 1.0;
  std::optional<Polygon> area;  // whose border is drawn
  std::vector<GridScene> grids;
  std::vector<DrawnObject> objects;
  std::vector<ExplorationScene> explorations;
  std::vector<GoalMarker> goals;
  std::vector<Point> unreachable_places;
  std::vector<RobotPath> paths;
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_MAP_SCENE_H_
