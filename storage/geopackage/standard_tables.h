// The tables that the GeoPackage standard defines, without content of ours.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_STANDARD_TABLES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_STANDARD_TABLES_H_

#include "absl/status/status.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// "GPKG", and the version 1.3 as the standard has it in user_version.
inline constexpr int kGeoPackageApplicationId = 0x47504B47;
inline constexpr int kGeoPackageVersion = 10300;

// Makes an empty database an empty GeoPackage: its ids, the core tables, those of tiles, features,
// extensions and the tiled gridded coverage, and the spatial references that are required.
absl::Status CreateStandardTables(Database* database);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_STANDARD_TABLES_H_
