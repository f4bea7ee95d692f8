// Polygons as GeoPackageBinary: the header 'GP' with the envelope, then well-known binary.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_GEOMETRY_BLOB_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_GEOMETRY_BLOB_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/geometry/polygon.h"

namespace hypermap::storage {

// The spatial reference of all that Hypermap stores: "undefined Cartesian", metres of some frame.
inline constexpr int kUndefinedCartesianSrsId = -1;

// Little-endian, with an XY envelope; the vertices keep their exact coordinates.
std::string EncodeGeometryBlob(const Polygon& polygon);

// Takes either byte order and any envelope. What EncodeGeometryBlob wrote comes back with the same
// rings; a polygon wound the other way, which is not ours, is validated and turned. DATA_LOSS.
absl::StatusOr<Polygon> DecodeGeometryBlob(absl::string_view blob);

// The box of a polygon without checking that it is a valid one: from the envelope, or from the
// vertices when there is none. An empty box for an empty geometry. DATA_LOSS.
absl::StatusOr<Box> BoxOfGeometryBlob(absl::string_view blob);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_GEOMETRY_BLOB_H_
