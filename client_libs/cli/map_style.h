// The colours and marks of a map's picture, for the plan and its legend.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_MAP_STYLE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_MAP_STYLE_H_

#include <map>
#include <string>

#include "client_libs/cli/canvas.h"
#include "client_libs/cli/map_scene.h"
#include "map/geometry/line_string.h"
#include "map/geometry/shape.h"

namespace hypermap::cli {

inline constexpr Colour kFree = Grey(0.97);
inline constexpr Colour kOccupied = Grey(0.08);
inline constexpr Colour kUnknown = Grey(0.6);
// Factors of the colours below: of cells at the high and the low end of a GridStyle::kShade
// (explored and unexplored floor), of floor that is not to be explored, and of the ends of a kTint.
inline constexpr Colour kBright = Grey(1.0);
inline constexpr Colour kDarkened{0.42, 0.47, 0.62};
inline constexpr Colour kNotToExplore = Grey(0.87);
inline constexpr Colour kLowest{1.0, 0.98, 0.86};
inline constexpr Colour kHighest{0.95, 0.6, 0.58};
// Borders of the area that was asked for, and of the areas that are explored.
inline constexpr Colour kAreaBorder{0.0, 0.25, 0.9};
inline constexpr Colour kExplorationBorder{0.85, 0.0, 0.35};
inline constexpr Colour kUnreachable{0.85, 0.0, 0.0};

// Colours that tell the robots of a picture apart.
class RobotColours {
 public:
  // Of all robots that the scene names.
  explicit RobotColours(const MapScene& scene);

  // Black for a robot that the scene does not name, or an unknown one ("").
  Colour Of(const std::string& robot) const;

 private:
  std::map<std::string, Colour> colours_;
};

// On a light ground of its own, so that it stands out from whatever lies below.
void DrawExplorationBorder(Canvas& canvas, const Polygon& area, const Plan& plan);
void DrawPath(Canvas& canvas, const RobotPath& path, const Plan& plan, const Colour& c);

// An object that is a line string or a point, in the colour of its class; paler the less certain
// its existence is. `at` in pixels.
void DrawLineObject(Canvas& canvas, const LineString& line, const Plan& plan, const Colour& c,
                    double existence);
void DrawPointObject(Canvas& canvas, const Point& at, const Colour& c, double existence);

// Around a place in pixels.
void DrawPathEnd(Canvas& canvas, const Point& at, const Colour& c);
void DrawGoal(Canvas& canvas, const Point& at, const Colour& c);
void DrawUnreachablePlace(Canvas& canvas, const Point& at);

// Samples for the legend; the lower left corner is at the place.
inline constexpr double kSampleWidth = 24.0;
void DrawBorderSample(Canvas& canvas, const Point& at);
void DrawPathSample(Canvas& canvas, const Point& at, const Colour& c);
// Of a class of objects with this kind of shape.
void DrawObjectSample(Canvas& canvas, const Point& at, ShapeKind kind, const Colour& c);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_MAP_STYLE_H_
