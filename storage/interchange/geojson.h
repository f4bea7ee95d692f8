// GeoJSON in local planar metres: coordinates are (x, y) of the frame named by the collection's
// member "frame", not longitude and latitude (which RFC 7946 would have; a "crs" member says so to
// readers that know it).
#ifndef HYPERMAP_STORAGE_INTERCHANGE_GEOJSON_H_
#define HYPERMAP_STORAGE_INTERCHANGE_GEOJSON_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/snapshot.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::storage {

// Features become edits of `layer`, which is made (semantic, in the collection's frame or the map's
// own) where `snapshot` has none; `snapshot` may be null for a new map. On a semantic layer a
// Polygon feature is an object put (a MultiPolygon one object a part), with "id" the one it
// replaces, and a feature with an id and a null geometry deletes that object. On a grid layer each
// Polygon fills the cells whose centres it covers with its property "value" (a number, a keyword of
// the layer, or null = unknown).
absl::StatusOr<ImportedMap> DecodeGeoJson(absl::string_view data, const std::string& layer,
                                          const Snapshot* snapshot, const ImportLimits& limits);

// One file `<map_name>.geojson` with the objects of `layers` (all semantic ones when empty) in the
// map's frame. Grids are omissions.
absl::StatusOr<ExportedFiles> EncodeGeoJson(const Snapshot& snapshot,
                                            const std::vector<std::string>& layers);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_GEOJSON_H_
