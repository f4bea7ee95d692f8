// RAII owners for the reentrant C API of GEOS. Private to this folder: no other file of the project
// uses GEOS types. A context belongs to one thread at a time, and must outlive its geometries.
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

  // Returns the calling thread's own context. Geometries made with it must not be passed to other
  // threads.
  static GeosContext& OfThisThread();

  GEOSContextHandle_t handle() const { return handle_; }
  GeosGeometry Own(GEOSGeometry* geometry) const {
    return GeosGeometry(geometry, GeosGeometryDeleter{handle_});
  }

  // Returns INTERNAL with the last message of GEOS, after a call that failed while doing `what`.
  absl::Status Error(absl::string_view what) const;

  // All functions that make geometries return null on failure. Rings are open, as in Polygon.
  GeosGeometry MakePolygon(const Rings& rings) const;
  GeosGeometry MakeClosedLine(const Ring& ring) const;
  GeosGeometry MakeGeometry(const Shape& shape) const;

  // Returns the rings of a GEOS polygon, opened; empty on failure.
  Rings RingsOf(const GEOSGeometry& polygon) const;

 private:
  // If `close`, repeats the first vertex at the end.
  GEOSCoordSequence* MakeSequence(const std::vector<Point>& vertices, bool close) const;
  Ring RingOf(const GEOSGeometry* line) const;

  GEOSContextHandle_t handle_;
  std::string last_message_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_GEOS_CONTEXT_H_
