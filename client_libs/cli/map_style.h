// Colours and symbols of a map's picture, shared by the plan and its legend.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_MAP_STYLE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_MAP_STYLE_H_

#include <map>
#include <string>

#include "client_libs/cli/canvas.h"
#include "client_libs/cli/map_scene.h"
#include "map/geometry/line_string.h"
#include "map/geometry/polygon.h"
#include "map/geometry/shape.h"
#include "map/grid/grid_geometry.h"

namespace hypermap::cli {

inline constexpr Colour kFree = Grey(0.97);
inline constexpr Colour kOccupied = Grey(0.08);
inline constexpr Colour kUnknown = Grey(0.6);
// Colours that multiply the picture below: for explored and unexplored floor (the high and the low
// end of a GridStyle::kShade), for floor outside the explored areas, and for the ends of a kTint.
inline constexpr Colour kBright = Grey(1.0);
inline constexpr Colour kDarkened{0.42, 0.47, 0.62};
inline constexpr Colour kNotToExplore = Grey(0.87);
inline constexpr Colour kLowest{1.0, 0.98, 0.86};
inline constexpr Colour kHighest{0.95, 0.6, 0.58};
// Borders of the requested area and of explored areas.
inline constexpr Colour kAreaBorder{0.0, 0.25, 0.9};
inline constexpr Colour kExplorationBorder{0.85, 0.0, 0.35};
inline constexpr Colour kUnreachable{0.85, 0.0, 0.0};

// Colours that distinguish the robots of a picture.
class RobotColours {
 public:
  // Assigns a colour to each robot that the scene names.
  explicit RobotColours(const MapScene& scene);

  // Black for a robot that the scene does not name, and for an unknown one ("").
  Colour Of(const std::string& robot) const;

 private:
  std::map<std::string, Colour> colours_;
};

// These draw a light halo below, so that the line stands out from any background.
void DrawExplorationBorder(Canvas& canvas, const Polygon& area, const Plan& plan);
void DrawPath(Canvas& canvas, const RobotPath& path, const Plan& plan, const Colour& c);

// The corners of a run of cells, in the frame of the geometry.
Ring CornersOf(const CellRun& run, const GridGeometry& geometry);

// Draw an object that is a line string or a point in the colour of its class, paler the less
// certain its existence is. `at` is in pixels.
void DrawLineObject(Canvas& canvas, const LineString& line, const Plan& plan, const Colour& c,
                    double existence);
void DrawPointObject(Canvas& canvas, const Point& at, const Colour& c, double existence);

// Symbols around a place in pixels.
void DrawPathEnd(Canvas& canvas, const Point& at, const Colour& c);
void DrawGoal(Canvas& canvas, const Point& at, const Colour& c);
void DrawUnreachablePlace(Canvas& canvas, const Point& at);

// Samples for the legend, with their lower left corner at `at`.
inline constexpr double kSampleWidth = 24.0;
void DrawBorderSample(Canvas& canvas, const Point& at);
void DrawPathSample(Canvas& canvas, const Point& at, const Colour& c);
// Sample for a class of objects with this kind of shape.
void DrawObjectSample(Canvas& canvas, const Point& at, ShapeKind kind, const Colour& c);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_MAP_STYLE_H_
