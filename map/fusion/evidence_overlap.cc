#include "map/fusion/evidence_overlap.h"

#include <algorithm>

#include "map/geometry/overlap.h"

namespace hypermap::fusion {

OutlineOverlap OverlapOf(const Polygon& a, const Polygon& b) {
  const double common = IntersectionArea(a, b);
  if (common <= 0.0) return {};
  const double area_a = Area(a);
  const double area_b = Area(b);
  return {common / (area_a + area_b - common), common / std::min(area_a, area_b)};
}

double HeightOverlap(HeightRange a, HeightRange b, double min_range_m) {
  const auto widen = [min_range_m](HeightRange* h) {
    const double lack = min_range_m - (h->high_m - h->low_m);
    if (lack <= 0.0) return;
    h->low_m -= 0.5 * lack;
    h->high_m += 0.5 * lack;
  };
  widen(&a);
  widen(&b);
  const double common = std::min(a.high_m, b.high_m) - std::max(a.low_m, b.low_m);
  return std::max(0.0, common) / std::min(a.high_m - a.low_m, b.high_m - b.low_m);
}

}  // namespace hypermap::fusion
