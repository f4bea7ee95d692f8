// The beginning of a fused layer's log: its base, and the names of the observations before it,
// which are no longer kept.
#ifndef HYPERMAP_STORAGE_POSTGRES_EVIDENCE_RETENTION_H_
#define HYPERMAP_STORAGE_POSTGRES_EVIDENCE_RETENTION_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "storage/fusion_log.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// As the methods of FusionLog.
absl::StatusOr<std::optional<FusionBase>> FindBase(Connection& connection, int64_t map,
                                                   const std::string& layer);
absl::StatusOr<bool> HasForgotten(Connection& connection, int64_t map, const std::string& layer,
                                  const std::string& robot);
absl::StatusOr<std::optional<FusionCheckpoint>> FindNextBase(Connection& connection, int64_t map,
                                                             const std::string& layer,
                                                             absl::Time stored_before);

absl::StatusOr<std::vector<ForgottenNames>> ReadForgotten(
    Connection& connection, int64_t map, const std::string& layer,
    const std::optional<ForgottenNames>& after, int max_count);

// As the method of FusionLog, within a transaction of the caller.
absl::Status MoveBase(Connection& connection, int64_t map, const std::string& layer,
                      const LogKey& checkpoint);

// Removes at most `max_rows` entries up to the bases of their logs, within a transaction of the
// caller, and notes the names of the observations. Returns the number of removed rows.
absl::StatusOr<int64_t> RemoveForgottenEvidence(Connection& connection, int64_t map,
                                                int64_t max_rows);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_EVIDENCE_RETENTION_H_
