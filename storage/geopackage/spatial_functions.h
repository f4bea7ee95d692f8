// The SQL functions that the triggers of the GeoPackage R*Tree extension call.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_SPATIAL_FUNCTIONS_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_SPATIAL_FUNCTIONS_H_

#include "absl/status/status.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Registers ST_IsEmpty, ST_MinX, ST_MaxX, ST_MinY and ST_MaxY on a connection. The standard
// triggers need them to keep the index, whether Hypermap, GDAL or QGIS writes. The functions return
// NULL when the argument is not a geometry that geometry_blob.h understands.
absl::Status RegisterSpatialFunctions(Database* database);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_SPATIAL_FUNCTIONS_H_
