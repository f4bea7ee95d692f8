// hypermap.receipts: the answers to the requests of commits.
#ifndef HYPERMAP_STORAGE_POSTGRES_RECEIPTS_H_
#define HYPERMAP_STORAGE_POSTGRES_RECEIPTS_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/libpq/connection.h"
#include "storage/map_store.h"

namespace hypermap::storage::postgres {

// nullopt when there is none. DATA_LOSS.
absl::StatusOr<std::optional<Receipt>> FindReceipt(Connection& connection, int64_t map,
                                                   absl::string_view request_id);

// As ReadableMap::Receipts.
absl::StatusOr<std::vector<TimedReceipt>> ReadReceipts(Connection& connection, int64_t map,
                                                       absl::string_view after, int max_count);

// Sends a receipt. The pipeline fails with ALREADY_EXISTS when there is one for its request.
void AddReceipt(Pipeline& pipeline, int64_t map, const TimedReceipt& timed);

// Sends the receipt of the commit when it has a request id. The pipeline fails with ALREADY_EXISTS
// when there is a receipt for that id.
void AddReceipt(Pipeline& pipeline, int64_t map, const Commit& commit);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_RECEIPTS_H_
