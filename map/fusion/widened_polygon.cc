#include "map/fusion/widened_polygon.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hypermap::fusion {
namespace {

// Returns the index of the lowest (then leftmost) vertex. From there, the edges of a
// counter-clockwise convex ring come in the order of their directions, as Widened needs them.
size_t LowestVertex(const Ring& ring) {
  const auto lower = [](const Point& a, const Point& b) {
    return std::pair(a.y, a.x) < std::pair(b.y, b.x);
  };
  return static_cast<size_t>(std::min_element(ring.begin(), ring.end(), lower) - ring.begin());
}

}  // namespace

// The octagon begins at its lowest vertex, too.
Polygon Widened(const Polygon& convex, double margin_m) {
  const double diagonal = margin_m * std::sqrt(0.5);
  const Ring octagon = {{0.0, -margin_m},     {diagonal, -diagonal}, {margin_m, 0.0},
                        {diagonal, diagonal}, {0.0, margin_m},       {-diagonal, diagonal},
                        {-margin_m, 0.0},     {-diagonal, -diagonal}};
  if (convex.empty() || margin_m <= 0.0) return convex;
  const Ring& ring = convex.outer();
  const size_t n = ring.size();
  const size_t first = LowestVertex(ring);
  const auto at = [&](size_t i) { return ring[(first + i) % n]; };
  const auto turn = [&](size_t i) { return octagon[i % octagon.size()]; };
  Ring sum;
  sum.reserve(n + octagon.size());
  for (size_t i = 0, k = 0; i < n || k < octagon.size();) {
    sum.push_back({at(i).x + turn(k).x, at(i).y + turn(k).y});
    const Point a{at(i + 1).x - at(i).x, at(i + 1).y - at(i).y};
    const Point b{turn(k + 1).x - turn(k).x, turn(k + 1).y - turn(k).y};
    const double cross = a.x * b.y - a.y * b.x;
    const bool take_a = k == octagon.size() || (i < n && cross >= 0.0);
    const bool take_b = i == n || (k < octagon.size() && cross <= 0.0);
    if (take_a) ++i;
    if (take_b) ++k;
  }
  return Polygon::MakeUnchecked({std::move(sum)});
}

}  // namespace hypermap::fusion
