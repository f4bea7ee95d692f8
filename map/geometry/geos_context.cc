#include "map/geometry/geos_context.h"

#include <exception>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"

namespace hypermap {

namespace {

// Not a std::runtime_error, after which GEOS would try the operation again with less precision.
class CancelledInGeos : public std::exception {
 public:
  const char* what() const noexcept override { return "cancelled"; }
};

// GEOS calls this now and then, on the thread that computes. An exception ends the operation like
// any other error of GEOS. GEOS_interruptRequest would not do: its flag is shared by all threads,
// so that it could end the operation of another one.
void ThrowIfCancelled() {
  if (IsCancelled()) throw CancelledInGeos();
}

}  // namespace

GeosContext::GeosContext() : handle_(GEOS_init_r()) {
  static const bool registered = (GEOS_interruptRegisterCallback(ThrowIfCancelled), true);
  static_cast<void>(registered);
  GEOSContext_setErrorMessageHandler_r(
      handle_,
      [](const char* message, void* context) {
        static_cast<GeosContext*>(context)->last_message_ = message;
      },
      this);
}

GeosContext::~GeosContext() { GEOS_finish_r(handle_); }

GeosContext& GeosContext::OfThisThread() {
  thread_local GeosContext context;
  return context;
}

absl::Status GeosContext::Error(absl::string_view what) const {
  return absl::InternalError(absl::StrCat(what, ": ", last_message_));
}

GEOSCoordSequence* GeosContext::MakeSequence(const std::vector<Point>& vertices, bool close) const {
  std::vector<double> xy;
  xy.reserve(2 * vertices.size() + 2);
  for (const Point& p : vertices) {
    xy.push_back(p.x);
    xy.push_back(p.y);
  }
  if (close) {
    xy.push_back(vertices.front().x);
    xy.push_back(vertices.front().y);
  }
  return GEOSCoordSeq_copyFromBuffer_r(handle_, xy.data(), xy.size() / 2, /*hasZ=*/0,
                                       /*hasM=*/0);
}

// Constructors of GEOS take ownership of their arguments, even if they fail.
GeosGeometry GeosContext::MakePolygon(const Rings& rings) const {
  std::vector<GeosGeometry> made;
  for (const Ring& ring : rings) {
    GEOSCoordSequence* sequence = MakeSequence(ring, /*close=*/true);
    if (sequence == nullptr) return Own(nullptr);
    made.push_back(Own(GEOSGeom_createLinearRing_r(handle_, sequence)));
    if (made.back() == nullptr) return Own(nullptr);
  }
  if (made.empty()) return Own(GEOSGeom_createEmptyPolygon_r(handle_));
  std::vector<GEOSGeometry*> holes;
  for (size_t i = 1; i < made.size(); ++i) holes.push_back(made[i].release());
  return Own(GEOSGeom_createPolygon_r(handle_, made.front().release(), holes.data(), holes.size()));
}

GeosGeometry GeosContext::MakeClosedLine(const Ring& ring) const {
  GEOSCoordSequence* sequence = MakeSequence(ring, /*close=*/true);
  if (sequence == nullptr) return Own(nullptr);
  return Own(GEOSGeom_createLineString_r(handle_, sequence));
}

GeosGeometry GeosContext::MakeGeometry(const Shape& shape) const {
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      return MakePolygon(shape.polygon().rings());
    case ShapeKind::kLineString: {
      GEOSCoordSequence* sequence = MakeSequence(shape.line_string().vertices(), /*close=*/false);
      if (sequence == nullptr) return Own(nullptr);
      return Own(GEOSGeom_createLineString_r(handle_, sequence));
    }
    case ShapeKind::kPoint:
      return Own(GEOSGeom_createPointFromXY_r(handle_, shape.point().x, shape.point().y));
  }
  return Own(nullptr);
}

Ring GeosContext::RingOf(const GEOSGeometry* line) const {
  const GEOSCoordSequence* sequence =
      line == nullptr ? nullptr : GEOSGeom_getCoordSeq_r(handle_, line);
  unsigned int size = 0;
  if (sequence == nullptr || !GEOSCoordSeq_getSize_r(handle_, sequence, &size) || size == 0) {
    return {};
  }
  std::vector<double> xy(2 * size);
  if (!GEOSCoordSeq_copyToBuffer_r(handle_, sequence, xy.data(), /*hasZ=*/0, /*hasM=*/0)) return {};
  Ring ring(size - 1);
  for (size_t i = 0; i < ring.size(); ++i) ring[i] = {xy[2 * i], xy[2 * i + 1]};
  return ring;
}

Rings GeosContext::RingsOf(const GEOSGeometry& polygon) const {
  Rings rings;
  rings.push_back(RingOf(GEOSGetExteriorRing_r(handle_, &polygon)));
  const int num_holes = GEOSGetNumInteriorRings_r(handle_, &polygon);
  for (int i = 0; i < num_holes; ++i) {
    rings.push_back(RingOf(GEOSGetInteriorRingN_r(handle_, &polygon, i)));
  }
  for (const Ring& ring : rings) {
    if (ring.empty()) return {};
  }
  return rings;
}

}  // namespace hypermap
