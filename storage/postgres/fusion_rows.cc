#include "storage/postgres/fusion_rows.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "storage/encoding/packed_bytes.h"

namespace hypermap::storage::postgres {

ObservationKey KeyAt(Rows* rows, int first) {
  return {absl::FromUnixNanos(rows->Int64(first)), std::string(rows->Text(first + 1)),
          rows->Int64(first + 2)};
}

LogKey LogKeyAt(Rows* rows, int first) { return {KeyAt(rows, first), rows->Int64(first + 3)}; }

absl::StatusOr<std::string> UnpackedAt(Rows* rows, int column) {
  const int64_t size = rows->Int64(column - 1);
  const absl::string_view packed = rows->Blob(column);
  HYPERMAP_RETURN_IF_ERROR(rows->row_status());
  return UnpackBytes(packed, size);
}

absl::StatusOr<FusionCheckpoint> CheckpointAt(Rows* rows, absl::string_view layer) {
  FusionCheckpoint checkpoint{LogKeyAt(rows, 0), "", absl::FromUnixNanos(rows->Int64(4))};
  absl::StatusOr<std::string> state = UnpackedAt(rows, 6);
  if (!state.ok()) return InRow(kCheckpointsTable, layer, checkpoint.key, state.status());
  checkpoint.state = *std::move(state);
  return checkpoint;
}

absl::Status InTable(absl::string_view table, absl::string_view layer, const absl::Status& status) {
  if (!absl::IsDataLoss(status)) return status;
  return absl::DataLossError(absl::StrCat(table, ", layer ", layer, ": ", status.message()));
}

absl::Status InRow(absl::string_view table, absl::string_view layer, const LogKey& key,
                   const absl::Status& status) {
  if (!absl::IsDataLoss(status)) return status;
  return absl::DataLossError(absl::StrCat(table, ", layer ", layer, ", stamp_ns ",
                                          absl::ToUnixNanos(key.after.stamp), ", robot ",
                                          key.after.robot, ", sequence ", key.after.sequence,
                                          ", number ", key.number, ": ", status.message()));
}

}  // namespace hypermap::storage::postgres
