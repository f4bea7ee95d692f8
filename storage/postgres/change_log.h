// hypermap.revisions and hypermap.changes: the commits of a map as they were written.
#ifndef HYPERMAP_STORAGE_POSTGRES_CHANGE_LOG_H_
#define HYPERMAP_STORAGE_POSTGRES_CHANGE_LOG_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "map/snapshot.h"
#include "storage/history.h"
#include "storage/libpq/connection.h"
#include "storage/postgres/object_versions.h"
#include "storage/postgres/tile_versions.h"

namespace hypermap::storage::postgres {

// All functions read within a snapshot transaction of the caller. Errors: those of Connection,
// those of TakeMemory for what is read, and DATA_LOSS naming the table and the row.

// At most `max_count` of the revisions after `after` and before `before`, as
// HistoryReader::Revisions.
absl::StatusOr<std::vector<RevisionRecord>> ReadRevisions(Connection& connection, int64_t map,
                                                          Revision after, Revision before,
                                                          bool newest_first, int64_t max_count);

// The commits after a revision that is kept, as HistoryReader::Commits. The number of statements is
// small: some for each thousand changes or some megabytes.
absl::StatusOr<std::vector<PastCommit>> ReadCommits(Connection& connection, int64_t map,
                                                    Revision after, int max_changes,
                                                    ObjectVersions* objects, TileVersions* tiles);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_CHANGE_LOG_H_
