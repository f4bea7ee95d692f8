// The default MapStore: a folder with one GeoPackage file for each map.
//
//   DATA_DIR/LOCK              held while the store is open
//   DATA_DIR/<map>.gpkg        a map (format: docs/geopackage_format.md), with SQLite's -wal and
//                              -shm beside it while it is open
//   DATA_DIR/<map>.gpkg-wal.orphan  a log that was found beside a file to which it does not belong
//   DATA_DIR/.<map>.gpkg.lock  held while the map is open; tells the revision that was acknowledged
//                              last (revision_witness.h)
//   DATA_DIR/.<map>.gpkg.new   a map that is being made; removed when found at opening
//   DATA_DIR/catalog.sqlite    which request deleted which map
//   DATA_DIR/reserve           space for deletions on a full disk
//   (GeoPackageOptions::reserve_bytes)
//   DATA_DIR/trash/<map>.<n>/  a deleted map (trash.h, GeoPackageOptions::trash_age)
//
// Other files in the folder are ignored. A map that can't be opened does not affect the others.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_STORE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_STORE_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "storage/geopackage/geopackage_options.h"
#include "storage/map_store.h"

namespace hypermap::storage {

// Opens the store and makes the folder when it is missing. FAILED_PRECONDITION naming the folder
// when another store is open in it, in this process or another. The store must outlive its maps.
absl::StatusOr<std::unique_ptr<MapStore>> OpenGeoPackageStore(
    const std::string& data_dir, const GeoPackageOptions& options = {});

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_STORE_H_
