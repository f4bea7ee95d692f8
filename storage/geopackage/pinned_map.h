// Reading the maps of a folder that a server may be using.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_PINNED_MAP_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_PINNED_MAP_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/geopackage/geopackage_options.h"
#include "storage/map_store.h"

namespace hypermap::storage {

// The end of the names of maps' files.
inline constexpr absl::string_view kMapExtension = ".gpkg";

// The names of the files of a folder, sorted. UNAVAILABLE.
absl::StatusOr<std::vector<std::string>> FileNamesIn(const std::string& folder);
// The maps whose files are in a folder, as MapStore::List.
absl::StatusOr<std::vector<std::string>> MapsInFolder(const std::string& folder);

// MapStore::Pin: one read transaction of SQLite, which keeps the log from being moved into the file
// as a whole until it is closed. Nothing is written. FAILED_PRECONDITION for a map of an older
// schema version, too.
absl::StatusOr<std::unique_ptr<ReadableMap>> PinGeoPackage(const std::string& folder,
                                                           const std::string& name,
                                                           const GeoPackageOptions& options);

// A store of which only List and Pin work, whether or not a server has the folder. Everything else
// fails with FAILED_PRECONDITION. NOT_FOUND if there is no such folder.
absl::StatusOr<std::unique_ptr<MapStore>> OpenGeoPackageReader(const std::string& folder);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_PINNED_MAP_H_
