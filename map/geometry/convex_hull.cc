#include "map/geometry/convex_hull.h"

#include <algorithm>
#include <utility>

#include "map/geometry/predicates.h"

namespace hypermap {
namespace {

// Adds `p` to a chain that turns left everywhere; the first `fixed` points stay.
void Extend(Ring& chain, size_t fixed, const Point& p) {
  while (chain.size() > fixed &&
         Orientation(chain[chain.size() - 2], chain[chain.size() - 1], p) <= 0) {
    chain.pop_back();
  }
  chain.push_back(p);
}

}  // namespace

// Andrew's monotone chain: the lower border from left to right, then the upper one back.
Polygon ConvexHull(std::vector<Point> points) {
  std::erase_if(points, [](const Point& p) { return !IsFinite(p); });
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return Polygon();
  Ring ring;
  for (const Point& p : points) Extend(ring, 1, p);
  const size_t lower = ring.size();
  for (size_t i = points.size() - 1; i-- > 0;) Extend(ring, lower, points[i]);
  ring.pop_back();  // the first point again
  if (ring.size() < 3) return Polygon();
  return Polygon::MakeUnchecked({std::move(ring)});
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
