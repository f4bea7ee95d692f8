// The content of a map's picture, as plain values.
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

// Style in which the cells of a grid are drawn.
enum class GridStyle {
  // Grey, from light at `low` (free) to dark at `high` (occupied). Drawn below all other grids.
  kFloor,
  // For two values: cells at `low` darken the picture below, cells at `high` leave it as it is.
  kShade,
  // A tint over the picture below, from faint at `low` to strong at `high`.
  kTint,
};

// A grid layer without its cells.
struct GridScene {
  std::string layer;
  GridStyle style = GridStyle::kTint;
  // The values drawn in the colours of the two ends, and the names of these values in the legend.
  double low = 0.0;
  double high = 1.0;
  std::string low_name;
  std::string high_name;

  // Returns 0 at `low` and 1 at `high`, linear in between.
  double ShareOf(double value) const {
    return high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0.0;
  }
};

// The members of an object that matter for drawing it.
struct DrawnObject {
  std::string label;
  double existence = 1.0;
  Shape shape;
};

// An area that robots explore. Floor in it for which the layer has no value counts as unexplored.
struct ExplorationScene {
  Polygon area;
  std::string layer;  // empty: no layer is drawn
};

// The place to which a robot drives.
struct GoalMarker {
  std::string robot;  // empty: unknown
  Point at;
};

// Everything that is drawn, in the coordinates of one frame.
struct MapScene {
  std::string title;
  Box box;  // the visible part of the plane; must have an area
  double pixels_per_m = 1.0;
  std::optional<Polygon> area;  // drawn as a border
  std::vector<GridScene> grids;
  std::vector<DrawnObject> objects;
  std::vector<ExplorationScene> explorations;
  std::vector<GoalMarker> goals;
  std::vector<Point> unreachable_places;
  std::vector<RobotPath> paths;
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_MAP_SCENE_H_
