#include "storage/interchange/shape_repair.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/geometry/predicates.h"
#include "map/geometry/repair.h"

namespace hypermap::storage {
namespace {

// Counting crossings takes time with the square of the vertices.
constexpr size_t kMaxVerticesToFill = 4000;
// The crossings that a recorded hull may have. They cost no more than reading its vertices.
constexpr int64_t kFreeCrossings = 50;

bool Cross(const Point& a, const Point& b, const Point& c, const Point& d) {
  if (std::max(a.x, b.x) < std::min(c.x, d.x) || std::max(c.x, d.x) < std::min(a.x, b.x) ||
      std::max(a.y, b.y) < std::min(c.y, d.y) || std::max(c.y, d.y) < std::min(a.y, b.y)) {
    return false;
  }
  return Orientation(a, b, c) * Orientation(a, b, d) <= 0 &&
         Orientation(c, d, a) * Orientation(c, d, b) <= 0;
}

// Pairs of edges that are no neighbours and share a point, counted up to `limit`.
int64_t CountCrossings(const Ring& ring, int64_t limit) {
  int64_t crossings = 0;
  const size_t n = ring.size();
  for (size_t i = 0; i < n && !IsCancelled(); ++i) {
    for (size_t j = i + 2; j < n && crossings < limit; ++j) {
      if (Cross(ring[i], ring[(i + 1) % n], ring[j], ring[(j + 1) % n])) ++crossings;
    }
  }
  return crossings;
}

// Returns whether the ring may be filled, and subtracts its crossings beyond kFreeCrossings from
// `crossings_left`.
bool TakeCrossings(const Ring& ring, int64_t& crossings_left) {
  if (ring.size() > kMaxVerticesToFill) return false;
  const int64_t crossings = CountCrossings(ring, kFreeCrossings + crossings_left + 1);
  const int64_t cost = std::max<int64_t>(0, crossings - kFreeCrossings);
  if (cost > crossings_left) return false;
  crossings_left -= cost;
  return true;
}

absl::StatusOr<RepairedShape> Fill(const Ring& ring, const absl::Status& fault,
                                   int64_t& crossings_left) {
  const bool may_fill = TakeCrossings(ring, crossings_left);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  if (!may_fill) {
    return absl::ResourceExhaustedError(
        absl::StrCat(fault.message(), ", too often for it to be filled"));
  }
  absl::StatusOr<std::vector<Polygon>> filled = FillNonZero(ring);
  RepairedShape shape;
  if (!filled.ok()) {
    // The vertices are finite, so what can't be filled encloses no area.
    if (!absl::IsInvalidArgument(filled.status())) return filled.status();
    shape.repairs.push_back(absl::StrCat(fault.message(), ": left out"));
    return shape;
  }
  shape.polygons = *std::move(filled);
  std::string line = absl::StrCat(fault.message(), ": filled by winding");
  if (shape.polygons.size() > 1) {
    absl::StrAppend(&line, " into ", shape.polygons.size(), " polygons");
  }
  shape.repairs.push_back(std::move(line));
  return shape;
}

bool IsFlat(const Ring& ring) {
  return ring.size() < 3 || std::all_of(ring.begin() + 2, ring.end(), [&](const Point& p) {
           return Orientation(ring[0], ring[1], p) == 0;
         });
}

// Takes out the holes that have no area. Breaks off when the work of this thread is cancelled.
std::vector<std::string> DropFlatHoles(std::vector<Ring>& rings) {
  std::vector<std::string> repairs;
  size_t number = 0;
  const auto is_flat = [&](const Ring& hole) {
    ++number;
    if (IsCancelled() || !IsFlat(hole)) return false;
    repairs.push_back(absl::StrCat("hole ", number, " encloses no area: left out"));
    return true;
  };
  rings.erase(std::remove_if(rings.begin() + 1, rings.end(), is_flat), rings.end());
  return repairs;
}

}  // namespace

absl::StatusOr<RepairedShape> RepairShape(std::vector<Ring> rings, int64_t& crossings_left) {
  RepairedShape shape;
  if (rings.empty()) {
    shape.repairs.emplace_back("empty polygon: left out");
    return shape;
  }
  std::vector<Ring> holes(rings.begin() + 1, rings.end());
  absl::StatusOr<Polygon> polygon = Polygon::Make(rings.front(), holes);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  if (!polygon.ok() && !holes.empty()) {
    shape.repairs = DropFlatHoles(rings);
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    holes.assign(rings.begin() + 1, rings.end());
    polygon = Polygon::Make(rings.front(), holes);
  }
  if (polygon.ok()) {
    shape.polygons.push_back(*std::move(polygon));
    return shape;
  }
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  if (!holes.empty()) return polygon.status();
  HYPERMAP_ASSIGN_OR_RETURN(RepairedShape filled,
                            Fill(rings.front(), polygon.status(), crossings_left));
  std::move(filled.repairs.begin(), filled.repairs.end(), std::back_inserter(shape.repairs));
  shape.polygons = std::move(filled.polygons);
  return shape;
}

}  // namespace hypermap::storage
