#include "map/geometry/polygon.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/geometry/coordinates.h"
#include "map/geometry/predicates.h"
#include "map/geometry/ring_fault.h"

namespace hypermap {
namespace {

std::string RingName(size_t ring) {
  return ring == 0 ? "outer" : absl::StrCat("holes[", ring - 1, "]");
}

// The name of a ring in a sentence.
std::string RingTitle(size_t ring) { return ring == 0 ? "outer ring" : RingName(ring); }

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

// Names the rings at fault and the place.
absl::Status DescribeFault(const Rings& rings, const RingFault& fault) {
  for (const size_t i : {fault.other, fault.ring}) {
    if (AllOnOneLine(rings[i])) {
      return absl::InvalidArgumentError(absl::StrCat(RingTitle(i), " encloses no area"));
    }
  }
  const std::string ring = RingTitle(fault.ring), other = RingTitle(fault.other);
  const auto sentence = [&]() -> std::string {
    switch (fault.kind) {
      case RingFault::Kind::kTouchesItself:
        return absl::StrCat(ring, " touches itself");
      case RingFault::Kind::kCrossesItself:
        return absl::StrCat(ring, " crosses itself");
      case RingFault::Kind::kCrosses:
        if (fault.other == 0) return absl::StrCat(ring, " does not stay inside the outer ring");
        return absl::StrCat(other, " and ", ring, " overlap");
      case RingFault::Kind::kLiesOutside:
        return absl::StrCat(ring, " lies outside of the outer ring");
      case RingFault::Kind::kIsNested:
        return absl::StrCat(ring, " lies inside ", other);
      case RingFault::Kind::kDisconnects:
        return absl::StrCat(ring, " cuts the polygon apart where it touches ",
                            fault.other == 0 ? "the " : "", other);
    }
    return absl::StrCat(ring, " is at fault");
  }();
  return absl::InvalidArgumentError(
      absl::StrFormat("%s at (%.9g, %.9g)", sentence, fault.place.x, fault.place.y));
}

// Returns whether a simple ring is counter-clockwise. The turn at a vertex of the hull decides.
bool IsCounterClockwise(const Ring& ring) {
  const size_t lowest = std::min_element(ring.begin(), ring.end(), IsBefore) - ring.begin();
  const size_t n = ring.size();
  return Orientation(ring[(lowest + n - 1) % n], ring[lowest], ring[(lowest + 1) % n]) > 0;
}

bool RunsBackwards(const Ring& ring, bool is_outer) {
  double sum = 0.0;
  double magnitude = 0.0;
  for (size_t i = 2; i < ring.size(); ++i) {
    const double ax = ring[i - 1].x - ring[0].x;
    const double ay = ring[i - 1].y - ring[0].y;
    const double cross = ax * (ring[i].y - ring[0].y) - (ring[i].x - ring[0].x) * ay;
    sum += cross;
    magnitude += std::abs(cross);
  }
  return (is_outer ? -sum : sum) > 1e-9 * magnitude;
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
    const auto fault = FindRingFault(rings);
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    if (fault) return DescribeFault(rings, *fault);
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

bool RunsBackwards(const Rings& rings) {
  for (size_t i = 0; i < rings.size(); ++i) {
    if (RunsBackwards(rings[i], /*is_outer=*/i == 0)) return true;
  }
  return false;
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
