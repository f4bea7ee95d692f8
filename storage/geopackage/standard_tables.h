// The tables that the GeoPackage standard defines.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_STANDARD_TABLES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_STANDARD_TABLES_H_

#include "absl/status/status.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// "GPKG", and version 1.3 as the standard writes it to user_version.
inline constexpr int kGeoPackageApplicationId = 0x47504B47;
inline constexpr int kGeoPackageVersion = 10300;

// Makes an empty database an empty GeoPackage: sets its ids, creates the tables of the core, tiles,
// features, extensions and tiled gridded coverage, and inserts the required spatial references.
absl::Status CreateStandardTables(Database* database);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_STANDARD_TABLES_H_
