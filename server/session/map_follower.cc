#include "server/session/map_follower.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/edits/replay.h"

namespace hypermap::server {
namespace {

// Changes that are read at a time: what a reader of the map sees late is bounded by the work on
// them.
constexpr int kMaxChanges = 2000;

}  // namespace

absl::StatusOr<MapFollower::Steps> MapFollower::Read(const SnapshotPtr& from) {
  if (reader_ == nullptr) {
    HYPERMAP_ASSIGN_OR_RETURN(reader_, stored_->OpenHistory());
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<storage::PastCommit> commits,
                            reader_->Commits(from->revision, kMaxChanges));
  Steps steps{from, {}};
  for (storage::PastCommit& past : commits) {
    const Revision revision = past.record.revision;
    absl::StatusOr<SnapshotPtr> next = Replay(*steps.snapshot, revision, past.changes);
    if (!next.ok()) {
      return absl::DataLossError(
          absl::StrCat("map ", stored_->header().name, ": revision ", revision,
                       " does not follow from the one before: ", next.status().message()));
    }
    steps.snapshot = *std::move(next);
    steps.commits.push_back({revision, past.record.time, std::move(past.record.author),
                             std::make_shared<const std::vector<Change>>(std::move(past.changes)),
                             nullptr});
  }
  return steps;
}

}  // namespace hypermap::server
