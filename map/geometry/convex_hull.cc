#include "map/geometry/convex_hull.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "map/geometry/predicates.h"

namespace hypermap {
namespace {

constexpr size_t kFew = 32;

// Drops points that are clearly inside the octagon of the extreme points, so that fewer points need
// sorting (Akl and Toussaint 1978). Keeps those so near to its edges that rounding might matter.
void DropInner(std::vector<Point>* points) {
  // Counter-clockwise.
  constexpr std::array<Point, 8> kDirections = {
      {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
  std::array<Point, 8> extreme;
  extreme.fill(points->front());
  std::array<double, 8> farthest;
  farthest.fill(-std::numeric_limits<double>::infinity());
  for (const Point& p : *points) {
    for (size_t k = 0; k < extreme.size(); ++k) {
      const double along = kDirections[k].x * p.x + kDirections[k].y * p.y;
      if (along <= farthest[k]) continue;
      farthest[k] = along;
      extreme[k] = p;
    }
  }
  std::array<Point, 8> edges;
  for (size_t k = 0; k < edges.size(); ++k) {
    const Point& end = extreme[(k + 1) % extreme.size()];
    edges[k] = {end.x - extreme[k].x, end.y - extreme[k].y};
  }
  std::erase_if(*points, [&](const Point& p) {
    for (size_t k = 0; k < edges.size(); ++k) {
      const double left = edges[k].x * (p.y - extreme[k].y);
      const double right = edges[k].y * (p.x - extreme[k].x);
      const bool no_edge = edges[k].x == 0.0 && edges[k].y == 0.0;
      if (!no_edge && !(left - right > 1e-14 * (std::abs(left) + std::abs(right)))) return false;
    }
    return true;
  });
}

// Appends `p` to a chain that turns left everywhere. The first `fixed` points are never removed.
void Extend(Ring& chain, size_t fixed, const Point& p) {
  while (chain.size() > fixed &&
         Orientation(chain[chain.size() - 2], chain[chain.size() - 1], p) <= 0) {
    chain.pop_back();
  }
  chain.push_back(p);
}

}  // namespace

// Andrew's monotone chain: the lower hull from left to right, then the upper hull back.
Polygon ConvexHull(std::vector<Point> points) {
  std::erase_if(points, [](const Point& p) { return !IsFinite(p); });
  if (points.size() > kFew) DropInner(&points);
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return Polygon();
  Ring ring;
  for (const Point& p : points) Extend(ring, 1, p);
  const size_t lower = ring.size();
  for (size_t i = points.size() - 1; i-- > 0;) Extend(ring, lower, points[i]);
  ring.pop_back();  // Drop the first point, which comes again.
  if (ring.size() < 3) return Polygon();
  return Polygon::MakeUnchecked({std::move(ring)});
}

Polygon FootprintOf(const Shape& shape, double half_width_m) {
  if (shape.is_polygon()) return shape.polygon();
  std::vector<Point> corners;
  const auto add_corners = [&](const Point& p) {
    for (const double dx : {-half_width_m, half_width_m}) {
      for (const double dy : {-half_width_m, half_width_m}) corners.push_back({p.x + dx, p.y + dy});
    }
  };
  if (shape.kind() == ShapeKind::kPoint) {
    add_corners(shape.point());
  } else {
    for (const Point& p : shape.line_string().vertices()) add_corners(p);
  }
  return ConvexHull(std::move(corners));
}

bool IsConvex(const Polygon& polygon) {
  if (polygon.rings().size() != 1) return false;
  const Ring& ring = polygon.outer();
  const size_t n = ring.size();
  for (size_t i = 0; i < n; ++i) {
    if (Orientation(ring[i], ring[(i + 1) % n], ring[(i + 2) % n]) < 0) return false;
  }
  return true;
}

}  // namespace hypermap
