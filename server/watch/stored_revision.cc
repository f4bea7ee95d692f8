#include "server/watch/stored_revision.h"

#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::server {

absl::StatusOr<std::optional<storage::RevisionRecord>> FindRevision(MapSession& session,
                                                                    Revision revision) {
  HYPERMAP_ASSIGN_OR_RETURN(HistoryPool::Lease history, session.OpenHistory());
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::vector<storage::RevisionRecord> records,
      history->Revisions(revision - 1, revision + 1, /*newest_first=*/false, 1));
  if (records.empty()) return std::nullopt;
  return records.front();
}

absl::Status FutureRevisionError(MapSession& session, absl::string_view name, Revision revision,
                                 Revision newest) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto record, FindRevision(session, revision));
  if (!record) {
    return absl::OutOfRangeError(
        absl::StrCat(name, " ", revision, " is still to come, the newest is ", newest));
  }
  if (session.is_follower()) session.LookForRevisions();
  return absl::UnavailableError(absl::StrCat("this server does not have ", name, " ", revision,
                                             " yet, its newest is ", newest));
}

}  // namespace hypermap::server
