// Revisions that the store has, and perhaps not this server.
#ifndef HYPERMAP_SERVER_WATCH_STORED_REVISION_H_
#define HYPERMAP_SERVER_WATCH_STORED_REVISION_H_

#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// A kept revision; nullopt if the store has none of that number.
absl::StatusOr<std::optional<storage::RevisionRecord>> FindRevision(MapSession& session,
                                                                    Revision revision);

// The error of a request that begins at a revision after `newest`, the newest one here:
// OUT_OF_RANGE, or UNAVAILABLE, so that the caller comes again, if the store has it: of servers
// that share the map, another one may have told it. `name` is what the request calls the revision.
absl::Status FutureRevisionError(MapSession& session, absl::string_view name, Revision revision,
                                 Revision newest);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_STORED_REVISION_H_
