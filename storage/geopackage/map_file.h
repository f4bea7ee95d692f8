// A map's file from the outside: making it, opening it with every doubt, removing it.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_MAP_FILE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_MAP_FILE_H_

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/geopackage/geopackage_options.h"
#include "storage/map_store.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Makes an empty map's file, wholly and durably or not at all, building it as `temporary` first.
absl::Status CreateMapFile(const std::string& path, const std::string& temporary,
                           const MapHeader& header, const GeoPackageOptions& options);

// Opens a map's file for writing, of the newest schema version, checked and set to write ahead.
// FAILED_PRECONDITION for a file that is no map, of a newer version, or read-only; DATA_LOSS for
// one that is damaged.
absl::StatusOr<std::unique_ptr<Database>> OpenMapFile(const std::string& path,
                                                      const GeoPackageOptions& options);

// Removes what SQLite keeps beside a map's file. The file must not be there.
absl::Status RemoveSidecars(const std::string& path);

// Removes a map's file and what is beside it, durably. When the file itself can't be removed,
// nothing is.
absl::Status RemoveMapFile(const std::string& path);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_MAP_FILE_H_
