#include "map/geometry/overlap.h"

#include <algorithm>
#include <utility>

#include "map/geometry/convex_hull.h"
#include "map/geometry/geos_context.h"

namespace hypermap {
namespace {

double Cross(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Clips the convex `ring` to the left of the line a -> b (Sutherland and Hodgman, "Reentrant
// polygon clipping", 1974). The result is in `kept`.
void ClipToLeft(const Ring& ring, const Point& a, const Point& b, Ring& kept) {
  kept.clear();
  if (ring.empty()) return;
  Point before = ring.back();
  double before_side = Cross(a, b, before);
  for (const Point& p : ring) {
    const double side = Cross(a, b, p);
    if ((side > 0.0 && before_side < 0.0) || (side < 0.0 && before_side > 0.0)) {
      const double t = before_side / (before_side - side);
      kept.push_back({before.x + t * (p.x - before.x), before.y + t * (p.y - before.y)});
    }
    if (side >= 0.0) kept.push_back(p);
    before = p;
    before_side = side;
  }
}

// Relative to the first vertex, which avoids cancellation far from the origin.
double RingArea(const Ring& ring) {
  double twice = 0.0;
  for (size_t i = 2; i < ring.size(); ++i) twice += Cross(ring[0], ring[i - 1], ring[i]);
  return std::max(0.0, twice / 2.0);
}

double ConvexIntersectionArea(const Ring& a, const Ring& b) {
  Ring kept = a, next;
  for (size_t i = 0; i < b.size() && !kept.empty(); ++i) {
    ClipToLeft(kept, b[i], b[(i + 1) % b.size()], next);
    std::swap(kept, next);
  }
  return RingArea(kept);
}

double GeosIntersectionArea(const Polygon& a, const Polygon& b) {
  const GeosContext& geos = GeosContext::OfThisThread();
  const GeosGeometry left = geos.MakePolygon(a.rings());
  const GeosGeometry right = geos.MakePolygon(b.rings());
  if (left == nullptr || right == nullptr) return 0.0;
  const GeosGeometry shared = geos.Own(GEOSIntersection_r(geos.handle(), left.get(), right.get()));
  double area = 0.0;
  if (shared == nullptr || GEOSArea_r(geos.handle(), shared.get(), &area) != 1) return 0.0;
  return area;
}

}  // namespace

double IntersectionArea(const Polygon& a, const Polygon& b) {
  if (a.empty() || b.empty() || !a.bounds().Intersects(b.bounds())) return 0.0;
  if (IsConvex(a) && IsConvex(b)) return ConvexIntersectionArea(a.outer(), b.outer());
  return GeosIntersectionArea(a, b);
}

double Iou(const Polygon& a, const Polygon& b) {
  const double shared = IntersectionArea(a, b);
  if (shared <= 0.0) return 0.0;
  return std::min(1.0, shared / (Area(a) + Area(b) - shared));
}

}  // namespace hypermap
