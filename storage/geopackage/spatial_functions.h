// The SQL functions that the triggers of the GeoPackage R*Tree extension call.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_SPATIAL_FUNCTIONS_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_SPATIAL_FUNCTIONS_H_

#include "absl/status/status.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Registers ST_IsEmpty, ST_MinX, ST_MaxX, ST_MinY and ST_MaxY on a connection, so that the standard
// triggers keep the index for us as they do for GDAL and QGIS, whoever of us writes. They give NULL
// for what is no geometry.
absl::Status RegisterSpatialFunctions(Database* database);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_SPATIAL_FUNCTIONS_H_
