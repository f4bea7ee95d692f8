#include "client_libs/cli/map_style.h"

#include <array>

namespace hypermap::cli {
namespace {

// The palette of Okabe and Ito, which most colour-blind people can distinguish as well, without its
// palest colour.
constexpr std::array<Colour, 6> kRobots{{{0.0, 0.45, 0.7},
                                         {0.9, 0.6, 0.0},
                                         {0.0, 0.62, 0.45},
                                         {0.8, 0.4, 0.7},
                                         {0.34, 0.71, 0.91},
                                         {0.6, 0.3, 0.1}}};

// Widths and radii in pixels.
constexpr double kBorderWidth = 4.0;
constexpr double kPathWidth = 3.5;
constexpr double kEndRadius = 8.0;
constexpr double kGoalRadius = 10.0;
constexpr double kCrossSize = 8.0;
constexpr double kObjectLineWidth = 3.0;
constexpr double kObjectRadius = 5.0;
constexpr double kObjectRim = 1.0;  // dark, on each side
// The light halo around a symbol, on each side.
constexpr double kHalo = 2.0;
constexpr Colour kHaloColour = Grey(1.0);

Colour RimOf(const Colour& c) { return Mix(c, kBlack, 0.4); }
Colour Faded(const Colour& c, double existence) { return Mix(c, Grey(1.0), existence); }

}  // namespace

RobotColours::RobotColours(const MapScene& scene) {
  for (const RobotPath& path : scene.paths) colours_[path.robot] = kBlack;
  for (const GoalMarker& goal : scene.goals) colours_[goal.robot] = kBlack;
  colours_.erase("");  // unknown robots stay black
  size_t next = 0;
  for (auto& [robot, colour] : colours_) colour = kRobots[next++ % kRobots.size()];
}

Colour RobotColours::Of(const std::string& robot) const {
  const auto it = colours_.find(robot);
  return it == colours_.end() ? kBlack : it->second;
}

void DrawExplorationBorder(Canvas& canvas, const Polygon& area, const Plan& plan) {
  canvas.Outline(area, plan, kHaloColour, kBorderWidth + 2 * kHalo, false);
  canvas.Outline(area, plan, kExplorationBorder, kBorderWidth, true);
}

void DrawPath(Canvas& canvas, const RobotPath& path, const Plan& plan, const Colour& c) {
  canvas.Path(path.points, plan, kHaloColour, kPathWidth + 2 * kHalo);
  canvas.Path(path.points, plan, c, kPathWidth);
}

Ring CornersOf(const CellRun& run, const GridGeometry& geometry) {
  const double left = run.col_begin * geometry.resolution_m;
  const double right = run.col_end * geometry.resolution_m;
  const double low = run.row * geometry.resolution_m;
  const double high = (run.row + 1) * geometry.resolution_m;
  const PlanarTransform& t = geometry.layer_from_grid;
  return {t * Point{left, low}, t * Point{right, low}, t * Point{right, high},
          t * Point{left, high}};
}

void DrawLineObject(Canvas& canvas, const LineString& line, const Plan& plan, const Colour& c,
                    double existence) {
  canvas.Path(line.vertices(), plan, RimOf(c), kObjectLineWidth + 2 * kObjectRim);
  canvas.Path(line.vertices(), plan, Faded(c, existence), kObjectLineWidth);
}

void DrawPointObject(Canvas& canvas, const Point& at, const Colour& c, double existence) {
  canvas.Disc(at, kObjectRadius + kObjectRim, RimOf(c));
  canvas.Disc(at, kObjectRadius, Faded(c, existence));
}

void DrawPathEnd(Canvas& canvas, const Point& at, const Colour& c) {
  canvas.Disc(at, kEndRadius + kHalo, kHaloColour);
  canvas.Disc(at, kEndRadius, Mix(c, kBlack, 0.5));
  canvas.Disc(at, kEndRadius - kHalo, c);
}

void DrawGoal(Canvas& canvas, const Point& at, const Colour& c) {
  canvas.Disc(at, kGoalRadius + kHalo, kHaloColour);
  canvas.Disc(at, kGoalRadius, c);
  canvas.Disc(at, kGoalRadius - 2 * kHalo, kHaloColour);
  canvas.Disc(at, kGoalRadius - 4 * kHalo, c);
}

void DrawUnreachablePlace(Canvas& canvas, const Point& at) {
  canvas.Cross(at, kCrossSize + kHalo, kHaloColour, kPathWidth + 2 * kHalo);
  canvas.Cross(at, kCrossSize, kUnreachable, kPathWidth);
}

void DrawBorderSample(Canvas& canvas, const Point& at) {
  canvas.Line({at.x, at.y - 5}, {at.x + kSampleWidth, at.y - 5}, kExplorationBorder,
              kBorderWidth - 1.0, true);
}

void DrawPathSample(Canvas& canvas, const Point& at, const Colour& c) {
  const Point end{at.x + kSampleWidth - kEndRadius, at.y - 6};
  canvas.Line({at.x, end.y}, end, c, kPathWidth, false);
  DrawPathEnd(canvas, end, c);
}

void DrawObjectSample(Canvas& canvas, const Point& at, ShapeKind kind, const Colour& c) {
  constexpr double kSize = 14.0;
  const Point middle{at.x + kSize / 2, at.y - 6};
  switch (kind) {
    case ShapeKind::kPolygon:
      canvas.Square({at.x - 1, at.y + 1}, kSize + 2, Mix(c, kBlack, 0.5));
      canvas.Square(at, kSize, c);
      break;
    case ShapeKind::kLineString:
      canvas.Line({at.x - kObjectRim, middle.y}, {at.x + kSize + kObjectRim, middle.y}, RimOf(c),
                  kObjectLineWidth + 2 * kObjectRim, false);
      canvas.Line({at.x, middle.y}, {at.x + kSize, middle.y}, c, kObjectLineWidth, false);
      break;
    case ShapeKind::kPoint:
      DrawPointObject(canvas, middle, c, 1.0);
      break;
  }
}

}  // namespace hypermap::cli
