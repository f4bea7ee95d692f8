// What the tables of the log of evidence have in common.
#ifndef HYPERMAP_STORAGE_POSTGRES_FUSION_ROWS_H_
#define HYPERMAP_STORAGE_POSTGRES_FUSION_ROWS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/fusion_log.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

inline constexpr char kCheckpointsTable[] = "hypermap.fusion_checkpoints";
inline constexpr char kObservationsTable[] = "hypermap.observations";

// Reads a key from the columns stamp_ns, robot and sequence, of which stamp_ns is column `first`.
ObservationKey KeyAt(Rows* rows, int first);
// As KeyAt, with the column `number` after them.
LogKey LogKeyAt(Rows* rows, int first);

// Reads bytes that were packed from a column and the one before it, which has their size.
absl::StatusOr<std::string> UnpackedAt(Rows* rows, int column);

// The columns of a checkpoint.
inline constexpr char kCheckpointColumns[] =
    "stamp_ns, robot, sequence, number, stored_at_ns, state_size, state";
// Reads a checkpoint from a row of kCheckpointColumns. DATA_LOSS naming table and row.
absl::StatusOr<FusionCheckpoint> CheckpointAt(Rows* rows, absl::string_view layer);

// Adds the table and the layer to an error if it is DATA_LOSS.
absl::Status InTable(absl::string_view table, absl::string_view layer, const absl::Status& status);
// As InTable, with the key of the row.
absl::Status InRow(absl::string_view table, absl::string_view layer, const LogKey& key,
                   const absl::Status& status);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_FUSION_ROWS_H_
