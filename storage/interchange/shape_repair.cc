#include "storage/interchange/shape_repair.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "map/geometry/predicates.h"
#include "map/geometry/repair.h"

namespace hypermap::storage {
namespace {

// Filling costs time and memory with the number of crossings, which grows with the square of the
// vertices. Recorded hulls have some dozens of either.
constexpr size_t kMaxVerticesToFill = 4000;
constexpr int kMaxCrossingsToFill = 20000;

bool Cross(const Point& a, const Point& b, const Point& c, const Point& d) {
  if (std::max(a.x, b.x) < std::min(c.x, d.x) || std::max(c.x, d.x) < std::min(a.x, b.x) ||
      std::max(a.y, b.y) < std::min(c.y, d.y) || std::max(c.y, d.y) < std::min(a.y, b.y)) {
    return false;
  }
  return Orientation(a, b, c) * Orientation(a, b, d) <= 0 &&
         Orientation(c, d, a) * Orientation(c, d, b) <= 0;
}

// Pairs of edges that are no neighbours and share a point, counted up to just past `limit`.
bool CrossesMoreOftenThan(const Ring& ring, int limit) {
  int crossings = 0;
  const size_t n = ring.size();
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = i + 2; j < n; ++j) {
      if (Cross(ring[i], ring[(i + 1) % n], ring[j], ring[(j + 1) % n]) && ++crossings > limit) {
        return true;
      }
    }
  }
  return false;
}

absl::StatusOr<RepairedShape> Fill(const Ring& ring, const absl::Status& fault) {
  if (ring.size() > kMaxVerticesToFill || CrossesMoreOftenThan(ring, kMaxCrossingsToFill)) {
    return absl::InvalidArgumentError(absl::StrCat(fault.message(), ", too often to be filled"));
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

// Takes out the holes that have no area.
std::vector<std::string> DropFlatHoles(std::vector<Ring>& rings) {
  std::vector<std::string> repairs;
  for (size_t i = 1, number = 1; i < rings.size(); ++number) {
    const Ring& ring = rings[i];
    const bool flat =
        ring.size() < 3 || std::all_of(ring.begin() + 2, ring.end(), [&](const Point& p) {
          return Orientation(ring[0], ring[1], p) == 0;
        });
    if (flat) {
      repairs.push_back(absl::StrCat("hole ", number, " encloses no area: left out"));
      rings.erase(rings.begin() + i);
    } else {
      ++i;
    }
  }
  return repairs;
}

}  // namespace

absl::StatusOr<RepairedShape> RepairShape(std::vector<Ring> rings) {
  RepairedShape shape;
  if (rings.empty()) {
    shape.repairs.emplace_back("empty polygon: left out");
    return shape;
  }
  std::vector<Ring> holes(rings.begin() + 1, rings.end());
  absl::StatusOr<Polygon> polygon = Polygon::Make(rings.front(), holes);
  if (!polygon.ok() && !holes.empty()) {
    shape.repairs = DropFlatHoles(rings);
    holes.assign(rings.begin() + 1, rings.end());
    polygon = Polygon::Make(rings.front(), holes);
  }
  if (polygon.ok()) {
    shape.polygons.push_back(*std::move(polygon));
    return shape;
  }
  if (!holes.empty()) return polygon.status();
  absl::StatusOr<RepairedShape> filled = Fill(rings.front(), polygon.status());
  if (!filled.ok()) return filled.status();
  std::move(filled->repairs.begin(), filled->repairs.end(), std::back_inserter(shape.repairs));
  shape.polygons = std::move(filled->polygons);
  return shape;
}

}  // namespace hypermap::storage
