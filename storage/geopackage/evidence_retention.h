// The beginning of a fused layer's log: its base, and the names of the observations before it,
// which are no longer kept.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_EVIDENCE_RETENTION_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_EVIDENCE_RETENTION_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "storage/fusion_log.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

inline constexpr char kBasesTable[] = "hypermap_fusion_bases";
inline constexpr char kForgottenTable[] = "hypermap_forgotten_sequences";

// Creates the tables.
extern const char kCreateRetentionTables[];

// As the methods of FusionLog.
absl::StatusOr<std::optional<FusionBase>> FindFusionBase(Database* database,
                                                         const std::string& layer);
absl::StatusOr<bool> HasForgottenObservations(Database* database, const std::string& layer,
                                              const std::string& robot);
absl::StatusOr<std::optional<FusionCheckpoint>> FindNextFusionBase(Database* database,
                                                                   const std::string& layer,
                                                                   absl::Time stored_before);
absl::Status MoveFusionBase(Database* database, const std::string& layer, const LogKey& checkpoint);

// As the method of FusionLog.
absl::StatusOr<std::vector<ForgottenNames>> ReadForgotten(
    Database* database, const std::string& layer, const std::optional<ForgottenNames>& after,
    int max_count);

// Write what a copy of a log has (FusionChange), within a transaction of the caller.
absl::Status PutFusionBase(Database* database, const std::string& layer, const FusionBase& base);
absl::Status InsertForgotten(Database* database, const std::string& layer,
                             const ForgottenNames& names);

// Returns whether the name is one of a forgotten observation whose row is removed.
absl::StatusOr<bool> IsForgotten(Database* database, const std::string& layer,
                                 const std::string& robot, int64_t sequence);

// Removes at most `max_rows` entries up to the bases of their logs, within a transaction of the
// caller, and notes the names of the observations. Returns the number of removed rows.
absl::StatusOr<int64_t> RemoveForgottenEvidence(Database* database, int64_t max_rows);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_EVIDENCE_RETENTION_H_
