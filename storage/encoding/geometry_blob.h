// Shapes as GeoPackageBinary (OGC 12-128r17, clause 2.1.3): the header "GP" with flags, spatial
// reference and envelope, followed by the well-known binary (WKB) of a polygon, a line string or a
// point. Other kinds of geometry, and Z or M coordinates, are not understood.
#ifndef HYPERMAP_STORAGE_ENCODING_GEOMETRY_BLOB_H_
#define HYPERMAP_STORAGE_ENCODING_GEOMETRY_BLOB_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/geometry/shape.h"

namespace hypermap::storage {

// The spatial reference of everything that Hypermap stores: "undefined Cartesian", metres in the
// frame of the layer.
inline constexpr int kUndefinedCartesianSrsId = -1;

// Encodes little-endian with exact coordinates. Polygons and line strings get an XY envelope;
// points get none, as GDAL writes them. REQUIRES: the shape is not empty.
std::string EncodeGeometryBlob(const Shape& shape);

// Decodes either byte order and any envelope. A blob of EncodeGeometryBlob gives an equal shape. A
// polygon that runs the other way was written by another program: it is validated and turned.
// DATA_LOSS when the blob is damaged, empty or of another kind of geometry.
absl::StatusOr<Shape> DecodeGeometryBlob(absl::string_view blob);

// Reads the bounds of a geometry without validating it: the envelope if there is one, else the box
// of the vertices. The box is empty for an empty geometry. DATA_LOSS as for DecodeGeometryBlob.
absl::StatusOr<Box> BoxOfGeometryBlob(absl::string_view blob);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_ENCODING_GEOMETRY_BLOB_H_
