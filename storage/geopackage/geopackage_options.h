// What can be set of the GeoPackage store.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_OPTIONS_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_OPTIONS_H_

#include <cstdint>

#include "absl/time/time.h"

namespace hypermap::storage {

struct GeoPackageOptions {
  // How long to wait for another program that writes to a map's file.
  absl::Duration busy_timeout = absl::Seconds(5);
  // Files up to this size are checked for damage as a whole when they are opened.
  int64_t max_checked_bytes = int64_t{256} << 20;
  // A map's file does not grow past this size; 0: as large as the disk.
  int64_t max_map_bytes = 0;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_OPTIONS_H_
