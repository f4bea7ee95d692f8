#include "client_libs/cpp/replica/mirrored_map.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "map/watch/carry_out.h"

namespace hypermap::client {

absl::StatusOr<SnapshotPtr> After(const Snapshot& before, const WatchEvent& event) {
  Snapshot start;
  if (event.snapshot) {
    start.map_name = before.map_name;
    start.frame_id = event.map ? event.map->frame_id : before.frame_id;
  } else {
    start = before;
  }
  absl::StatusOr<SnapshotPtr> after = CarryOut(std::move(start), event.revision, event.changes);
  if (after.ok()) return after;
  return absl::InternalError(absl::StrCat("the server's answer: ", after.status().message()));
}

}  // namespace hypermap::client
