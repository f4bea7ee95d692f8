// DATA_DIR/trash: deleted maps, which people may still bring back.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TRASH_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TRASH_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"

namespace hypermap::storage {

// A folder with a folder <map>.<number> for each deleted map. In it are the map's file, its log,
// and a log that was set aside, under the names that they had. A deleted map's age is counted from
// the time of modification of its folder. One thread at a time.
class Trash {
 public:
  // Makes no folder yet. Deleted maps are kept for `age`; 0: the trash takes none.
  Trash(std::string folder, absl::Duration age);

  bool keeps_maps() const { return age_ > absl::ZeroDuration(); }

  // Moves a map's file and the files beside it here, durably. The map's file is moved first: after
  // an error before that, the map is as it was. May be repeated after an error or a crash.
  // REQUIRES: keeps_maps(), and no connection has the file open.
  absl::Status Take(const std::string& path, const std::string& map, int64_t deletion);

  // Gives a map's file another name here, durably, so that another file can take its place in one
  // step. REQUIRES: as Take, and the file has no log beside it.
  absl::Status Link(const std::string& path, const std::string& map);

  // Removes the names that Link has given to files which are in `data_dir` still, because a crash
  // came before others took their places.
  absl::Status RemoveLinksTo(const std::string& data_dir);

  // Removes the maps for good that were deleted `age` before `now`, or earlier.
  absl::Status RemoveOld(absl::Time now);

  // Removes the map for good that was deleted first. NOT_FOUND if there is none.
  absl::Status RemoveOldest();

 private:
  // Makes the folder of a deleted map, durably.
  absl::Status MakeEntry(const std::string& entry) const;

  struct Entry {
    absl::Time since;
    std::string path;
  };
  // The deleted maps, in the order of their deletion.
  absl::StatusOr<std::vector<Entry>> FindEntries() const;

  const std::string folder_;
  const absl::Duration age_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TRASH_H_
