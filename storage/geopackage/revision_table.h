// hypermap_revisions and hypermap_receipts: which commits a map has had, and what their requests
// were answered.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_REVISION_TABLE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_REVISION_TABLE_H_

#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/map_store.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Notes the commit, and a receipt when it has a request id. ALREADY_EXISTS when that id has one.
absl::Status InsertRevision(Database* database, const Commit& commit);

absl::StatusOr<std::optional<Receipt>> ReadReceipt(Database* database,
                                                   absl::string_view request_id);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_REVISION_TABLE_H_
