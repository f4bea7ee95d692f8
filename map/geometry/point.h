// Points and boxes in the plane. Plain values; all lengths are in metres.
#ifndef HYPERMAP_MAP_GEOMETRY_POINT_H_
#define HYPERMAP_MAP_GEOMETRY_POINT_H_

#include <algorithm>
#include <cmath>
#include <limits>

namespace hypermap {

// A position (x, y) in some frame, in metres.
struct Point {
  double x = 0.0;
  double y = 0.0;

  friend bool operator==(const Point&, const Point&) = default;
};

inline bool IsFinite(const Point& p) { return std::isfinite(p.x) && std::isfinite(p.y); }

// A closed axis-aligned box. A default-constructed box is empty: it contains nothing, and extending
// it by a point makes it that point.
struct Box {
  Point min{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  Point max{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};

  bool empty() const { return min.x > max.x || min.y > max.y; }
  void Extend(const Point& p) {
    min = {std::min(min.x, p.x), std::min(min.y, p.y)};
    max = {std::max(max.x, p.x), std::max(max.y, p.y)};
  }
  void Extend(const Box& b) {
    if (b.empty()) return;
    Extend(b.min);
    Extend(b.max);
  }
  bool Covers(const Point& p) const {
    return p.x >= min.x && p.x <= max.x && p.y >= min.y && p.y <= max.y;
  }
  bool Intersects(const Box& b) const {
    return min.x <= b.max.x && b.min.x <= max.x && min.y <= b.max.y && b.min.y <= max.y;
  }

  friend bool operator==(const Box&, const Box&) = default;
};

// Distance in metres from `p` to the nearest point of `box`; 0 inside. `box` must not be empty.
inline double Distance(const Box& box, const Point& p) {
  const double dx = std::max({box.min.x - p.x, 0.0, p.x - box.max.x});
  const double dy = std::max({box.min.y - p.y, 0.0, p.y - box.max.y});
  return std::hypot(dx, dy);
}

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_POINT_H_
