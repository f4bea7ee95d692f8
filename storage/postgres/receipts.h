// hypermap.receipts: the answers to the requests of commits.
#ifndef HYPERMAP_STORAGE_POSTGRES_RECEIPTS_H_
#define HYPERMAP_STORAGE_POSTGRES_RECEIPTS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "storage/libpq/connection.h"
#include "storage/map_store.h"

namespace hypermap::storage::postgres {

// nullopt when there is none. DATA_LOSS.
absl::StatusOr<std::optional<Receipt>> FindReceipt(Connection& connection, int64_t map,
                                                   absl::string_view request_id);

// The receipts of those of the requests that have one, in one statement. DATA_LOSS.
absl::StatusOr<std::vector<Receipt>> FindReceipts(Connection& connection, int64_t map,
                                                  absl::Span<const std::string> request_ids);

// As ReadableMap::Receipts.
absl::StatusOr<std::vector<TimedReceipt>> ReadReceipts(Connection& connection, int64_t map,
                                                       absl::string_view after, int max_count);

// The receipt of the commit; nullopt if it has no request id.
std::optional<TimedReceipt> ReceiptOf(const Commit& commit);

// Sends receipts. The pipeline fails with ALREADY_EXISTS when there is one for one of their
// requests.
void AddReceipts(Pipeline& pipeline, int64_t map, absl::Span<const TimedReceipt> receipts);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_RECEIPTS_H_
