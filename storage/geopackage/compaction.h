// Removes the history from before the oldest kept revision, and forgotten evidence, a few rows at a
// time.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_COMPACTION_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_COMPACTION_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/snapshot.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Removes at most `max_rows` rows that only revisions before `oldest` need, receipts older than
// `receipts_before`, and evidence up to the bases of its logs, within a transaction of the caller.
// True when there may be more such rows.
absl::StatusOr<bool> RemoveForgotten(Database* database, Revision oldest,
                                     absl::Time receipts_before, int64_t max_rows);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_COMPACTION_H_
