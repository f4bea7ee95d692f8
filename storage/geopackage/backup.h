// Copies of a map for backups, which are written while the map's writer goes on.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_BACKUP_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_BACKUP_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "storage/map_store.h"

namespace hypermap::storage {

// Opens the files of the map `name` for a copy. The copy is of the revision that is the newest when
// it begins to be written. `path` is that of the map's file, and must name it until this returns.
absl::StatusOr<std::unique_ptr<MapBackup>> OpenGeoPackageBackup(const std::string& name,
                                                                const std::string& path,
                                                                absl::Duration busy_timeout);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_BACKUP_H_
