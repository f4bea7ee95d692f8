#include "map/geometry/polygon.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "map/geometry/coordinates.h"
#include "map/geometry/geos_context.h"
#include "map/geometry/predicates.h"

namespace hypermap {
namespace {

std::string RingName(size_t ring) {
  return ring == 0 ? "outer" : absl::StrCat("holes[", ring - 1, "]");
}

// Drops vertices that repeat the one before, and closing vertices.
void DropRepeats(Ring& ring) {
  ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
  while (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
}

bool HasThreeDistinct(const Ring& ring) {
  if (ring.size() < 3) return false;
  // Neighbours differ, so that a third distinct point differs from the first two.
  return std::any_of(ring.begin() + 2, ring.end(),
                     [&](const Point& p) { return p != ring[0] && p != ring[1]; });
}

// The reason for which GEOS rejects a polygon.
struct Fault {
  bool found = false;
  std::string reason;
  std::string place;  // " at (x, y)".
};

Fault FindFault(const Rings& rings) {
  const GeosContext& geos = GeosContext::OfThisThread();
  const GeosGeometry polygon = geos.MakePolygon(rings);
  if (polygon == nullptr) return {true, "cannot be built", ""};
  char* reason = nullptr;
  GEOSGeometry* location = nullptr;
  const char valid =
      GEOSisValidDetail_r(geos.handle(), polygon.get(), /*flags=*/0, &reason, &location);
  const GeosGeometry owned_location = geos.Own(location);
  Fault fault;
  fault.found = valid != 1;
  if (reason != nullptr) {
    fault.reason = reason;
    GEOSFree_r(geos.handle(), reason);
  }
  Point at;
  if (location != nullptr && GEOSGeomGetX_r(geos.handle(), location, &at.x) == 1 &&
      GEOSGeomGetY_r(geos.handle(), location, &at.y) == 1) {
    fault.place = absl::StrFormat(" at (%.9g, %.9g)", at.x, at.y);
  }
  return fault;
}

bool AllOnOneLine(const Ring& ring) {
  return std::all_of(ring.begin() + 2, ring.end(),
                     [&](const Point& p) { return Orientation(ring[0], ring[1], p) == 0; });
}

bool IsBefore(const Point& a, const Point& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); }

// Returns whether the ring turns the same way at every vertex and winds once, which makes it valid.
// A ring that winds once changes between leftward and rightward only at its extreme vertices.
bool IsConvex(const Ring& ring) {
  const size_t n = ring.size();
  const int turn = Orientation(ring[n - 2], ring[n - 1], ring[0]);
  if (turn == 0) return false;
  int reversals = 0;
  for (size_t i = 0; i < n; ++i) {
    const Point& a = ring[(i + n - 1) % n];
    const Point& b = ring[i];
    const Point& c = ring[(i + 1) % n];
    if (Orientation(a, b, c) != turn) return false;
    if (IsBefore(a, b) != IsBefore(b, c)) ++reversals;
  }
  return reversals == 2;
}

// Finds the rings that cause `fault`; GEOS reports only the place.
absl::Status DescribeFault(const Rings& rings, const Fault& fault) {
  for (size_t i = 0; i < rings.size(); ++i) {
    const std::string name = i == 0 ? "outer ring" : RingName(i);
    if (AllOnOneLine(rings[i])) {
      return absl::InvalidArgumentError(absl::StrCat(name, " encloses no area"));
    }
    const Fault own = FindFault({rings[i]});
    if (!own.found) continue;
    const absl::string_view verb =
        own.reason == "Ring Self-intersection" ? " touches itself" : " crosses itself";
    return absl::InvalidArgumentError(absl::StrCat(name, verb, own.place));
  }
  for (size_t i = 1; i < rings.size(); ++i) {
    const Fault pair = FindFault({rings[0], rings[i]});
    if (!pair.found) continue;
    const absl::string_view verb = pair.reason == "Hole lies outside shell"
                                       ? " lies outside of the outer ring"
                                       : " does not stay inside the outer ring";
    return absl::InvalidArgumentError(absl::StrCat(RingName(i), verb, pair.place));
  }
  return absl::InvalidArgumentError(
      absl::StrCat("holes overlap or cut the polygon apart", fault.place));
}

// Returns whether a simple ring is counter-clockwise. The turn at a vertex of the hull decides.
bool IsCounterClockwise(const Ring& ring) {
  const size_t lowest = std::min_element(ring.begin(), ring.end(), IsBefore) - ring.begin();
  const size_t n = ring.size();
  return Orientation(ring[(lowest + n - 1) % n], ring[lowest], ring[(lowest + 1) % n]) > 0;
}

struct Moments {
  double area = 0.0;  // Signed.
  double x = 0.0;     // Area times centre, relative to the reference point.
  double y = 0.0;
};

// Relative to `reference`, because sums of products of large coordinates would lose small polygons.
Moments MomentsOf(const Polygon& polygon, const Point& reference) {
  Moments m;
  for (const Ring& ring : polygon.rings()) {
    Point a{ring.back().x - reference.x, ring.back().y - reference.y};
    for (const Point& vertex : ring) {
      const Point b{vertex.x - reference.x, vertex.y - reference.y};
      const double cross = a.x * b.y - b.x * a.y;
      m.area += cross / 2;
      m.x += (a.x + b.x) * cross / 6;
      m.y += (a.y + b.y) * cross / 6;
      a = b;
    }
  }
  return m;
}

}  // namespace

Polygon::Polygon(Rings rings) : rings_(std::move(rings)) {
  if (rings_.empty()) return;
  for (const Point& p : rings_.front()) bounds_.Extend(p);
}

absl::StatusOr<Polygon> Polygon::Make(Ring outer, std::vector<Ring> holes) {
  Rings rings;
  rings.reserve(1 + holes.size());
  rings.push_back(std::move(outer));
  for (Ring& hole : holes) rings.push_back(std::move(hole));

  for (size_t i = 0; i < rings.size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(CheckVertices(RingName(i), rings[i]));
  }
  for (size_t i = 0; i < rings.size(); ++i) {
    DropRepeats(rings[i]);
    if (!HasThreeDistinct(rings[i])) {
      return absl::InvalidArgumentError(
          absl::StrCat(RingName(i), " has fewer than 3 distinct vertices"));
    }
  }
  if (rings.size() > 1 || !IsConvex(rings.front())) {
    if (Fault fault = FindFault(rings); fault.found) return DescribeFault(rings, fault);
  }
  for (size_t i = 0; i < rings.size(); ++i) {
    // Keep the first vertex in its place.
    if (IsCounterClockwise(rings[i]) != (i == 0)) {
      std::reverse(rings[i].begin() + 1, rings[i].end());
    }
  }
  return Polygon(std::move(rings));
}

Polygon Polygon::MakeUnchecked(Rings rings) { return Polygon(std::move(rings)); }

Polygon Polygon::FromBox(const Box& box) {
  return Polygon({{box.min, {box.max.x, box.min.y}, box.max, {box.min.x, box.max.y}}});
}

int Polygon::num_vertices() const {
  size_t n = 0;
  for (const Ring& ring : rings_) n += ring.size();
  return static_cast<int>(n);
}

double Area(const Polygon& polygon) {
  if (polygon.empty()) return 0.0;
  return std::abs(MomentsOf(polygon, polygon.outer().front()).area);
}

Point Centroid(const Polygon& polygon) {
  if (polygon.empty()) return {};
  const Point reference = polygon.outer().front();
  const Moments m = MomentsOf(polygon, reference);
  // A sliver may be so thin that its area is 0 in doubles.
  if (m.area == 0.0) {
    const Box& b = polygon.bounds();
    return {(b.min.x + b.max.x) / 2, (b.min.y + b.max.y) / 2};
  }
  return {reference.x + m.x / m.area, reference.y + m.y / m.area};
}

}  // namespace hypermap
