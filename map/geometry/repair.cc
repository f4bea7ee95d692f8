#include "map/geometry/repair.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/geometry/geos_context.h"
#include "map/geometry/predicates.h"

namespace hypermap {
namespace {

// Returns whether all vertices are finite and at least three are distinct.
bool CanEnclose(Ring ring) {
  if (!std::all_of(ring.begin(), ring.end(), IsFinite)) return false;
  std::sort(ring.begin(), ring.end(),
            [](const Point& a, const Point& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  return std::unique(ring.begin(), ring.end()) - ring.begin() >= 3;
}

// Returns how many times `ring` winds around `p`, counter-clockwise counted positive. `p` must not
// be on the ring. Sums the signed crossings of a ray to the right.
int WindingNumber(const Ring& ring, const Point& p) {
  int winding = 0;
  Point a = ring.back();
  for (const Point& b : ring) {
    if (a.y <= p.y && b.y > p.y && Orientation(a, b, p) > 0) ++winding;
    if (a.y > p.y && b.y <= p.y && Orientation(a, b, p) < 0) --winding;
    a = b;
  }
  return winding;
}

// Calls `visit` with the parts of a collection, or with the geometry itself.
template <typename Visitor>
void VisitParts(const GeosContext& geos, const GEOSGeometry* geometry, Visitor visit) {
  const int n = GEOSGetNumGeometries_r(geos.handle(), geometry);
  for (int i = 0; i < n; ++i) visit(GEOSGetGeometryN_r(geos.handle(), geometry, i));
}

// Returns the faces into which the ring divides the plane, as a collection of polygons that share
// only boundaries; null on failure.
GeosGeometry Faces(const GeosContext& geos, const Ring& ring) {
  const GeosGeometry line = geos.MakeClosedLine(ring);
  if (line == nullptr) return geos.Own(nullptr);
  // The union of a line with itself splits it at its crossings and merges overlapping parts.
  const GeosGeometry noded = geos.Own(GEOSUnaryUnion_r(geos.handle(), line.get()));
  if (noded == nullptr) return geos.Own(nullptr);
  const GEOSGeometry* lines[] = {noded.get()};
  return geos.Own(GEOSPolygonize_r(geos.handle(), lines, 1));
}

bool WindsRound(const GeosContext& geos, const Ring& ring, const GEOSGeometry* face) {
  const GeosGeometry inner = geos.Own(GEOSPointOnSurface_r(geos.handle(), face));
  Point p;
  return inner != nullptr && GEOSGeomGetX_r(geos.handle(), inner.get(), &p.x) == 1 &&
         GEOSGeomGetY_r(geos.handle(), inner.get(), &p.y) == 1 && WindingNumber(ring, p) != 0;
}

// Returns the union of the faces around which `ring` winds; null on failure.
GeosGeometry FilledRegion(const GeosContext& geos, const Ring& ring) {
  const GeosGeometry faces = Faces(geos, ring);
  if (faces == nullptr) return geos.Own(nullptr);
  std::vector<GEOSGeometry*> filled;
  VisitParts(geos, faces.get(), [&](const GEOSGeometry* face) {
    // The caller drops what is filled when it is cancelled.
    if (IsCancelled()) return;
    if (WindsRound(geos, ring, face)) filled.push_back(GEOSGeom_clone_r(geos.handle(), face));
  });
  const GeosGeometry collection = geos.Own(
      GEOSGeom_createCollection_r(geos.handle(), GEOS_MULTIPOLYGON, filled.data(), filled.size()));
  if (collection == nullptr) return geos.Own(nullptr);
  return geos.Own(GEOSUnaryUnion_r(geos.handle(), collection.get()));
}

}  // namespace

absl::StatusOr<std::vector<Polygon>> FillNonZero(const Ring& ring) {
  absl::StatusOr<Polygon> as_it_is = Polygon::Make(ring);
  if (as_it_is.ok()) return std::vector<Polygon>{*std::move(as_it_is)};
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  if (!CanEnclose(ring)) return as_it_is.status();

  const GeosContext& geos = GeosContext::OfThisThread();
  const GeosGeometry region = FilledRegion(geos, ring);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  if (region == nullptr) return geos.Error("filling a ring");
  std::vector<Polygon> polygons;
  absl::Status status;
  VisitParts(geos, region.get(), [&](const GEOSGeometry* part) {
    if (GEOSisEmpty_r(geos.handle(), part) != 0) return;
    Rings rings = geos.RingsOf(*part);
    if (rings.empty()) return status.Update(geos.Error("reading a filled ring"));
    std::vector<Ring> holes(std::make_move_iterator(rings.begin() + 1),
                            std::make_move_iterator(rings.end()));
    absl::StatusOr<Polygon> polygon = Polygon::Make(std::move(rings.front()), std::move(holes));
    if (!polygon.ok()) return status.Update(polygon.status());
    polygons.push_back(*std::move(polygon));
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  if (polygons.empty()) return absl::InvalidArgumentError("outer ring encloses no area");
  std::stable_sort(polygons.begin(), polygons.end(),
                   [](const Polygon& a, const Polygon& b) { return Area(a) > Area(b); });
  return polygons;
}

}  // namespace hypermap
