// Settings of the GeoPackage store.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_OPTIONS_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_OPTIONS_H_

#include <cstdint>
#include <memory>

#include "absl/time/time.h"
#include "storage/cache_room.h"

namespace hypermap::storage {

struct GeoPackageOptions {
  // Time to wait while another program writes to a map's file.
  absl::Duration busy_timeout = absl::Seconds(5);
  // Every page of a file up to this size is checked for damage when the file is opened.
  int64_t max_checked_bytes = int64_t{256} << 20;
  // The largest size of a map's file; 0: no limit.
  int64_t max_map_bytes = 0;
  // Space on the disk that is kept free for deletions and the removal of history when the disk is
  // full, see DiskReserve; 0: none.
  int64_t reserve_bytes = 0;
  // How long deleted maps stay in DATA_DIR/trash, unless the disk gets full; 0: they are removed at
  // once.
  absl::Duration trash_age = absl::ZeroDuration();
  // Memory for what the readers of past revisions keep of the files that they have read. Never
  // null.
  CacheRoomPtr cache_room = std::make_shared<CacheRoom>(int64_t{256} << 20);
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_OPTIONS_H_
