// The register of a GeoPackage's tables: gpkg_contents and what belongs to it.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_CONTENTS_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_CONTENTS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "map/geometry/point.h"
#include "map/layers/layer_spec.h"
#include "storage/geopackage/tile_codec.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// The name of the geometry column of every feature table.
inline constexpr char kGeometryColumn[] = "geom";

// Announces `table` as the feature table, with an R*Tree index, of the layer.
absl::Status RegisterFeatures(Database* database, const std::string& table, const LayerSpec& spec);

// Announces `table` as the tiled gridded coverage of the layer: one tile matrix, in the grid's own
// axes (see kTileMatrixSide).
absl::Status RegisterCoverage(Database* database, const std::string& table, const LayerSpec& spec,
                              const CoverageCoding& coding);

// Sets the extent in use, NULL when empty, and when it was changed.
absl::Status SetContents(Database* database, const std::string& table, const Box& extent,
                         absl::Time last_change);

// Takes a table of either type out of the register.
absl::Status Unregister(Database* database, const std::string& table);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_CONTENTS_H_
