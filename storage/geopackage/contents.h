// The register of a GeoPackage's tables: gpkg_contents and what belongs to it.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_CONTENTS_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_CONTENTS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "map/geometry/point.h"
#include "map/layers/layer_spec.h"
#include "storage/encoding/tile_codec.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// The GeoPackage's register of its layers.
inline constexpr char kContentsTable[] = "gpkg_contents";

// The name of the geometry column of every feature table.
inline constexpr char kGeometryColumn[] = "geom";

// The geometry type that GeoPackage declares for a column: POLYGON, LINESTRING or POINT when it
// holds one kind only, else GEOMETRY.
absl::string_view GeometryTypeName(const ShapeKinds& kinds);

// Registers `table` as the feature table of the layer, with its geometry column and R*Tree index.
absl::Status RegisterFeatures(Database* database, const std::string& table, const LayerSpec& spec);

// Registers `table` as the tiled gridded coverage of the layer: one tile matrix, in the grid's own
// axes (see kTileMatrixSide).
absl::Status RegisterCoverage(Database* database, const std::string& table, const LayerSpec& spec,
                              const CoverageCoding& coding);

// Sets the extent of a registered table (NULL when empty) and the time of its last change.
absl::Status SetContents(Database* database, const std::string& table, const Box& extent,
                         absl::Time last_change);

// Removes a table of either type from the register.
absl::Status Unregister(Database* database, const std::string& table);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_CONTENTS_H_
