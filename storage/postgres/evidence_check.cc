#include "storage/postgres/evidence_check.h"

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/status/status_macros.h"
#include "storage/postgres/each_row.h"
#include "storage/postgres/fusion_rows.h"
#include "storage/postgres/row_names.h"

namespace hypermap::storage::postgres {
namespace {

// $map stands for the number of the map and $name for kEntryName. The size is NULL if the bytes are
// not compressed.
constexpr EvidenceTable kEvidenceTables[] = {
    {kObservationsTable,
     "SELECT stamp_ns, robot, sequence, number, '', '', body_size, body, $name "
     "FROM (SELECT *, 0::bigint AS number FROM hypermap.observations WHERE map = $map) AS o"},
    {"hypermap.operator_facts",
     "SELECT stamp_ns, robot, sequence, number, kind, track, NULL::bigint, body, $name "
     "FROM hypermap.operator_facts WHERE map = $map"},
    {"hypermap.fusion_bases",
     "SELECT stamp_ns, robot, sequence, number, '', '', state_size, state, $name "
     "FROM hypermap.fusion_bases WHERE map = $map",
     /*has_states=*/true},
    {kCheckpointsTable,
     "SELECT stamp_ns, robot, sequence, number, '', '', state_size, state, $name "
     "FROM hypermap.fusion_checkpoints WHERE map = $map",
     /*has_states=*/true},
};
constexpr int kKindColumn = 4;
constexpr int kSizeColumn = 6;
constexpr int kBytesColumn = 7;
constexpr int kNameColumn = 8;

absl::StatusOr<LogEntry> ReadEntry(Rows* row) {
  LogEntry entry{LogKeyAt(row, 0), std::string(row->Text(kKindColumn)),
                 std::string(row->Text(kKindColumn + 1)), ""};
  if (row->IsNull(kSizeColumn)) {
    entry.body = std::string(row->Blob(kBytesColumn));
  } else {
    HYPERMAP_ASSIGN_OR_RETURN(entry.body, UnpackedAt(row, kBytesColumn));
  }
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  return entry;
}

absl::Status CheckRow(Rows* row, const EvidenceTable& table, const EvidenceCheck& check) {
  HYPERMAP_ASSIGN_OR_RETURN(const LogEntry entry, ReadEntry(row));
  return check == nullptr || table.has_states ? absl::OkStatus() : check(entry);
}

}  // namespace

absl::Span<const EvidenceTable> EvidenceTables() { return kEvidenceTables; }

absl::Status CheckEvidence(Connection& connection, int64_t map, const EvidenceTable& table,
                           const EvidenceCheck& check, FindingList* findings) {
  const std::string sql =
      absl::StrReplaceAll(table.sql, {{"$map", absl::StrCat(map)}, {"$name", kEntryName}});
  return ForEachRow(connection, sql, [&](Rows* row) -> absl::Status {
    absl::Status status = CheckRow(row, table, check);
    if (status.ok()) return status;
    return findings->AddDamage(table.name, std::string(row->Text(kNameColumn)),
                               absl::DataLossError(status.message()));
  });
}

}  // namespace hypermap::storage::postgres
