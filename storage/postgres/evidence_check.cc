#include "storage/postgres/evidence_check.h"

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/postgres/each_row.h"
#include "storage/postgres/fusion_rows.h"
#include "storage/postgres/row_names.h"

namespace hypermap::storage::postgres {
namespace {

// The columns of EvidenceTable::sql. The size is NULL if the bytes are not compressed.
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

std::vector<EvidenceTable> EvidenceTables(int64_t map) {
  const auto select = [map](absl::string_view number, absl::string_view kind,
                            absl::string_view size, absl::string_view bytes,
                            absl::string_view table) {
    return absl::StrCat("SELECT stamp_ns, robot, sequence, number, ", kind, ", ", size, ", ", bytes,
                        ", ", kEntryName, " FROM (SELECT *", number, " FROM ", table,
                        " WHERE map = ", map, ") AS e");
  };
  const auto states = [&](absl::string_view table) {
    return select("", "'', ''", "state_size", "state", table);
  };
  constexpr char kFactsTable[] = "hypermap.operator_facts";
  constexpr char kBasesTable[] = "hypermap.fusion_bases";
  return {
      {kObservationsTable,
       select(", 0::bigint AS number", "'', ''", "body_size", "body", kObservationsTable)},
      {kFactsTable, select("", "kind, track", "NULL::bigint", "body", kFactsTable)},
      {kBasesTable, states(kBasesTable), /*has_states=*/true},
      {kCheckpointsTable, states(kCheckpointsTable), /*has_states=*/true, /*can_be_rebuilt=*/true},
  };
}

absl::Status CheckEvidence(Connection& connection, const EvidenceTable& table,
                           const EvidenceCheck& check, FindingList* findings) {
  return ForEachRow(connection, table.sql, [&](Rows* row) -> absl::Status {
    const absl::Status status = CheckRow(row, table, check);
    if (status.ok()) return status;
    return findings->AddDamage(table.name, std::string(row->Text(kNameColumn)),
                               absl::DataLossError(status.message()), table.can_be_rebuilt);
  });
}

}  // namespace hypermap::storage::postgres
