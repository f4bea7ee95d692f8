// Removes the history from before the oldest kept revision, and forgotten evidence, a few rows at a
// time.
#ifndef HYPERMAP_STORAGE_POSTGRES_COMPACTION_H_
#define HYPERMAP_STORAGE_POSTGRES_COMPACTION_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/snapshot.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// Removes at most `max_rows` rows of a map that only revisions before `oldest` need, receipts older
// than `receipts_before`, and evidence up to the bases of its logs, within a transaction of the
// caller. True when there may be more such rows.
absl::StatusOr<bool> RemoveForgotten(Connection& connection, int64_t map, Revision oldest,
                                     absl::Time receipts_before, int64_t max_rows);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_COMPACTION_H_
