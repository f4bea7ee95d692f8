// Owners for the reentrant GEOS C API. Private to this folder: no other file of the project sees a
// GEOS type. A context belongs to one thread at a time; geometries must not outlive theirs.
#ifndef HYPERMAP_MAP_GEOMETRY_GEOS_CONTEXT_H_
#define HYPERMAP_MAP_GEOMETRY_GEOS_CONTEXT_H_

#include <geos_c.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "map/geometry/polygon.h"
#include "map/geometry/shape.h"

namespace hypermap {

struct GeosGeometryDeleter {
  GEOSContextHandle_t handle;
  void operator()(GEOSGeometry* g) const { GEOSGeom_destroy_r(handle, g); }
};
using GeosGeometry = std::unique_ptr<GEOSGeometry, GeosGeometryDeleter>;

class GeosContext {
 public:
  GeosContext();
  ~GeosContext();
  GeosContext(const GeosContext&) = delete;
  GeosContext& operator=(const GeosContext&) = delete;

  // The calling thread's own context, for work that is over when the call returns.
  static GeosContext& OfThisThread();

  GEOSContextHandle_t handle() const { return handle_; }
  GeosGeometry Own(GEOSGeometry* geometry) const {
    return GeosGeometry(geometry, GeosGeometryDeleter{handle_});
  }

  // INTERNAL with what GEOS said last, for a call that failed while doing `what`.
  absl::Status Error(absl::string_view what) const;

  // Null on failure, as are all geometries below. Rings are open, as in Polygon.
  GeosGeometry MakePolygon(const Rings& rings) const;
  GeosGeometry MakeClosedLine(const Ring& ring) const;
  GeosGeometry MakeGeometry(const Shape& shape) const;

  // The rings of a GEOS polygon, opened; empty on failure.
  Rings RingsOf(const GEOSGeometry& polygon) const;

 private:
  // With `close`, the first vertex again at the end.
  GEOSCoordSequence* MakeSequence(const std::vector<Point>& vertices, bool close) const;
  Ring RingOf(const GEOSGeometry* line) const;

  GEOSContextHandle_t handle_;
  std::string last_message_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_GEOS_CONTEXT_H_
