// GeoJSON in local planar metres: coordinates are (x, y) in the frame that the collection's member
// "frame" names. RFC 7946 would have longitude and latitude instead; a "crs" member tells readers
// that know it.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_GEOJSON_H_
#define HYPERMAP_STORAGE_INTERCHANGE_GEOJSON_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/limits/limits.h"
#include "map/snapshot.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::storage {

// Decodes features to edits of `layer`. Where `snapshot` has no such layer, the edits create one
// (semantic, in the collection's frame or the map's own); a null `snapshot` stands for a new map.
//
// On a semantic layer, a feature with a Polygon, LineString or Point puts one object, which
// replaces the object with the feature's "id". A MultiPolygon, MultiLineString or MultiPoint puts
// one object for each part, the first of which has the "id". A feature with an "id" and a null
// geometry deletes that object.
//
// On a grid layer, a Polygon or MultiPolygon fills the cells whose centres it covers with its
// property "value": a number, a keyword of the layer, or null for unknown.
//
// INVALID_ARGUMENT naming the place in the file; NOT_FOUND for a deleted object that the layer does
// not have; RESOURCE_EXHAUSTED naming the limit.
absl::StatusOr<ImportedMap> DecodeGeoJson(absl::string_view data, const std::string& layer,
                                          const Snapshot* snapshot, const Limits& limits);

// Encodes the objects of `layers` (empty: of all layers) in the map's frame as one file,
// `<map_name>.geojson`. Grids and layers that are not connected to the map's frame are omissions.
// NOT_FOUND for a layer that the map does not have.
absl::StatusOr<ExportedFiles> EncodeGeoJson(const Snapshot& snapshot,
                                            const std::vector<std::string>& layers);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_GEOJSON_H_
