// hypermap_revisions and hypermap_receipts: the commits of a map, and the answers to their
// requests.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_REVISION_TABLE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_REVISION_TABLE_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/map_store.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Inserts the commit, and its receipt when it has a request id. ALREADY_EXISTS when there is a
// receipt for that id.
absl::Status InsertRevision(Database* database, const Commit& commit);

// Inserts a receipt. ALREADY_EXISTS when there is one for its request.
absl::Status InsertReceipt(Database* database, const TimedReceipt& timed);

// As ReadableMap::Receipts.
absl::StatusOr<std::vector<TimedReceipt>> ReadReceipts(Database* database, absl::string_view after,
                                                       int max_count);

// The commit time of a revision in nanoseconds since the Unix epoch; nullopt if it is not kept.
absl::StatusOr<std::optional<int64_t>> ReadCommitTime(Database* database, Revision revision);

// Nullopt when there is none.
absl::StatusOr<std::optional<Receipt>> ReadReceipt(Database* database,
                                                   absl::string_view request_id);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_REVISION_TABLE_H_
