#include "storage/geopackage/evidence_check.h"

#include <optional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "storage/encoding/packed_bytes.h"
#include "storage/geopackage/evidence_retention.h"
#include "storage/geopackage/find_rows.h"

namespace hypermap::storage {
namespace {

constexpr char kObservations[] = "hypermap_observations";
constexpr char kFacts[] = "hypermap_operator_facts";

struct Rule {
  const char* table;
  const char* problem;
  const char* sql;
};
constexpr Rule kRules[] = {
    {"hypermap_fusion", "there is no such semantic layer",
     "SELECT 'layer ' || layer FROM hypermap_fusion WHERE layer NOT IN "
     "(SELECT name FROM hypermap_layers WHERE kind = 'semantic')"},
    {kObservations, "the layer is not fused",
     "SELECT DISTINCT 'layer ' || layer FROM hypermap_observations WHERE layer NOT IN "
     "(SELECT layer FROM hypermap_fusion)"},
    {kFacts, "the layer is not fused",
     "SELECT DISTINCT 'layer ' || layer FROM hypermap_operator_facts WHERE layer NOT IN "
     "(SELECT layer FROM hypermap_fusion)"},
    {kFacts, "the fact is of no known kind",
     "SELECT 'id ' || id FROM hypermap_operator_facts WHERE kind NOT IN ('pin', 'remove')"},
    {kFacts, "the fact is out of order",
     "SELECT 'id ' || id FROM (SELECT id, number, lag(number, 1, 0) OVER (PARTITION BY layer "
     "ORDER BY stamp_ns, robot, sequence, number) AS earlier FROM hypermap_operator_facts) "
     "WHERE number <= earlier"},
    {kBasesTable, "the layer is not fused",
     "SELECT 'layer ' || layer FROM hypermap_fusion_bases WHERE layer NOT IN "
     "(SELECT layer FROM hypermap_fusion)"},
    {kForgottenTable, "the log of the layer has no base",
     "SELECT DISTINCT 'layer ' || layer FROM hypermap_forgotten_sequences WHERE layer NOT IN "
     "(SELECT layer FROM hypermap_fusion_bases)"},
    {kForgottenTable, "the sequences end before they begin",
     "SELECT 'id ' || id FROM hypermap_forgotten_sequences WHERE last_sequence < first_sequence"},
    {kForgottenTable, "the sequences are also in another row",
     "SELECT 'id ' || id FROM (SELECT id, first_sequence, lag(last_sequence) OVER (PARTITION BY "
     "layer, robot ORDER BY first_sequence) AS earlier FROM hypermap_forgotten_sequences) "
     "WHERE first_sequence <= earlier"},
    {kForgottenTable, "an observation is forgotten and kept",
     "SELECT 'id ' || f.id FROM hypermap_forgotten_sequences AS f WHERE EXISTS "
     "(SELECT 1 FROM hypermap_observations AS o WHERE o.layer = f.layer AND o.robot = f.robot "
     "AND o.sequence BETWEEN f.first_sequence AND f.last_sequence)"},
    {"hypermap_fusion_tracks", "the object's id was never assigned",
     "SELECT 'id ' || id FROM hypermap_fusion_tracks WHERE object_id < 0 OR object_id >= "
     "(SELECT next_object_id FROM hypermap_metadata)"},
};

// Reads the key from the columns stamp_ns, robot, sequence and number, which are the first after
// the id.
LogKey KeyOfRow(Statement* row) {
  return {{absl::FromUnixNanos(row->Int64(1)), std::string(row->Text(2)), row->Int64(3)},
          row->Int64(4)};
}

// An entry of the log from a row of the id, the key, kind, track, body and body_size, which is NULL
// if the body is not compressed. DATA_LOSS.
absl::StatusOr<LogEntry> ReadEntry(Statement* row) {
  LogEntry entry{KeyOfRow(row), std::string(row->Text(5)), std::string(row->Text(6)), ""};
  const absl::string_view body = row->Blob(7);
  const std::optional<int64_t> size = row->OptionalInt64(8);
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  if (!size) {
    entry.body = std::string(body);
    return entry;
  }
  HYPERMAP_ASSIGN_OR_RETURN(entry.body, UnpackBytes(body, *size));
  return entry;
}

absl::Status CheckEntry(Statement* row, const EvidenceCheck& check) {
  HYPERMAP_ASSIGN_OR_RETURN(const LogEntry entry, ReadEntry(row));
  return check ? check(entry) : absl::OkStatus();
}

// Checks each row of a query whose first column is the id.
template <typename Check>
absl::Status CheckEach(Database* database, const std::string& sql, const Check& check,
                       const Finding& about, FindingList* findings) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, database->Prepare(sql));
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return absl::OkStatus();
    const absl::Status status = check(&select);
    if (status.ok()) continue;
    HYPERMAP_RETURN_IF_ERROR(findings->AddDamage(about.table, absl::StrCat("id ", select.Int64(0)),
                                                 absl::DataLossError(status.message()),
                                                 about.can_be_rebuilt));
  }
}

absl::Status CheckState(Statement* row) {
  const absl::string_view state = row->Blob(1);
  const int64_t size = row->Int64(2);
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  return UnpackBytes(state, size).status();
}

}  // namespace

absl::Status CheckEvidenceLogs(Database* database, const EvidenceCheck& check,
                               FindingList* findings) {
  for (const auto& [table, problem, sql] : kRules) {
    HYPERMAP_RETURN_IF_ERROR(FindRows(database, {table, "", problem}, findings, sql));
  }
  const auto check_entry = [&check](Statement* row) { return CheckEntry(row, check); };
  HYPERMAP_RETURN_IF_ERROR(findings->AddDamage(
      kObservations, "",
      CheckEach(database,
                "SELECT id, stamp_ns, robot, sequence, 0, '', '', body, body_size "
                "FROM hypermap_observations",
                check_entry, {kObservations}, findings)));
  HYPERMAP_RETURN_IF_ERROR(findings->AddDamage(
      kFacts, "",
      CheckEach(database,
                "SELECT id, stamp_ns, robot, sequence, number, kind, track, body, NULL "
                "FROM hypermap_operator_facts",
                check_entry, {kFacts}, findings)));
  HYPERMAP_RETURN_IF_ERROR(findings->AddDamage(
      kBasesTable, "",
      CheckEach(database, "SELECT id, state, state_size FROM hypermap_fusion_bases", CheckState,
                {kBasesTable}, findings)));
  const Finding checkpoints{kCheckpointsTable, "", "", /*can_be_rebuilt=*/true};
  return findings->AddDamage(
      kCheckpointsTable, "",
      CheckEach(database, "SELECT id, state, state_size FROM hypermap_fusion_checkpoints",
                CheckState, checkpoints, findings),
      true);
}

}  // namespace hypermap::storage
