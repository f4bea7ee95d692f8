#include "storage/geopackage/map_repair.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/evidence_check.h"
#include "storage/geopackage/for_table.h"
#include "storage/geopackage/foreign_writes.h"
#include "storage/geopackage/geopackage_options.h"
#include "storage/geopackage/history_check.h"
#include "storage/geopackage/history_tables.h"
#include "storage/geopackage/layer_table.h"
#include "storage/geopackage/map_check.h"
#include "storage/geopackage/map_file.h"
#include "storage/geopackage/spatial_functions.h"
#include "storage/sqlite/durable_file.h"
#include "storage/sqlite/page_checksums.h"

namespace hypermap::storage {
namespace {

bool IsDamageOfPages(const Finding& finding) {
  return finding.table.empty() && !finding.can_be_rebuilt;
}

absl::Status CopyFile(const std::string& from, const std::string& to) {
  const std::string temporary = to + ".new";
  std::error_code error;
  std::filesystem::copy_file(from, temporary, std::filesystem::copy_options::overwrite_existing,
                             error);
  absl::Status status;
  if (error) status = absl::UnavailableError(absl::StrCat(temporary, ": ", error.message()));
  if (status.ok()) status = PublishFile(temporary, to);
  if (!status.ok()) RemoveFile(temporary).IgnoreError();
  return status;
}

// Makes an R*Tree empty, whatever is in its tables.
absl::Status MakeNewTree(Database* database, const std::string& tree) {
  std::string sql;
  {
    HYPERMAP_ASSIGN_OR_RETURN(
        Statement select,
        database->Prepare("SELECT sql FROM sqlite_master WHERE type = 'table' AND name = ?"));
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Bind(tree).Step());
    if (!has_row) return absl::DataLossError(absl::StrCat("there is no table ", tree));
    sql = std::string(select.Text(0));
    HYPERMAP_RETURN_IF_ERROR(select.row_status());
  }
  // Cached statements would keep resources of the dropped table.
  database->ForgetStatements();
  return database->Execute(absl::StrCat("DROP TABLE \"", tree, "\"; ", sql));
}

absl::Status RebuildObjectBoxes(Database* database) {
  HYPERMAP_RETURN_IF_ERROR(MakeNewTree(database, kObjectBoxesTable));
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select, database->Prepare("SELECT id, geom, first_revision, end_revision, lineage "
                                          "FROM hypermap_object_history ORDER BY id"));
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return absl::OkStatus();
    const VersionBox box =
        BoxOfVersion(select.Blob(1), select.Int64(2), select.Int64(3), select.Int64(4));
    HYPERMAP_RETURN_IF_ERROR(InsertVersionBox(database, select.Int64(0), box));
  }
}

// Rebuilds the tables and indexes of these names.
absl::Status Rebuild(Database* database, std::set<std::string> names) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<StoredLayer> layers, ReadLayers(database));
  for (const StoredLayer& layer : layers) {
    const std::string tree = absl::StrCat("rtree_", layer.table, "_geom");
    if (names.erase(tree) == 0) continue;
    HYPERMAP_RETURN_IF_ERROR(MakeNewTree(database, tree));
    HYPERMAP_RETURN_IF_ERROR(database->Execute(ForTable(kFillIndexOfPlaces, layer.table)));
  }
  if (names.erase(kObjectBoxesTable) > 0) HYPERMAP_RETURN_IF_ERROR(RebuildObjectBoxes(database));
  if (names.erase(kCheckpointsTable) > 0) {
    // Without them the logs are folded from their beginning.
    HYPERMAP_RETURN_IF_ERROR(database->Execute("DELETE FROM hypermap_fusion_checkpoints"));
  }
  // The rest are SQLite's own indexes.
  return names.empty() ? absl::OkStatus() : database->Execute("REINDEX");
}

}  // namespace

absl::Status CopyMapFile(const std::string& path, const std::string& copy) {
  if (PathExists(LogPathOf(path))) {
    HYPERMAP_RETURN_IF_ERROR(CopyFile(LogPathOf(path), LogPathOf(copy)));
  }
  return CopyFile(path, copy);
}

absl::Status SaveMapCopy(const std::string& path) {
  const std::string copy = CopyPathOf(path);
  if (PathExists(copy)) return absl::AlreadyExistsError(absl::StrCat(copy, " exists"));
  return CopyMapFile(path, copy);
}

std::string CopyPathOf(const std::string& path) { return absl::StrCat(path, ".before-repair"); }

absl::StatusOr<RepairReport> RepairMapFile(const std::string& path, const EvidenceCheck& evidence) {
  RepairReport report;
  HYPERMAP_ASSIGN_OR_RETURN(report.before, CheckMapFile(path, evidence));
  const std::vector<Finding>& findings = report.before.findings;
  if (std::any_of(findings.begin(), findings.end(), IsDamageOfPages)) {
    return absl::FailedPreconditionError(
        "pages of the file are damaged: fetch what they had from another copy of the map, with "
        "--from, or restore a backup");
  }
  std::set<std::string> names;
  for (const Finding& finding : findings) {
    if (finding.can_be_rebuilt) names.insert(finding.table);
  }
  report.after = report.before;
  if (names.empty()) return report;
  HYPERMAP_RETURN_IF_ERROR(SaveMapCopy(path));
  report.copy = CopyPathOf(path);
  const bool was_written = WasWrittenByOthers(path);
  {
    HYPERMAP_ASSIGN_OR_RETURN(
        const std::unique_ptr<Database> database,
        Database::Open(path, Database::OpenMode::kExisting, GeoPackageOptions().busy_timeout));
    // A file that another program wrote stays one, to which a server gives checksums.
    std::optional<UnverifiedReads> unverified;
    if (was_written) unverified.emplace(database->handle());
    HYPERMAP_RETURN_IF_ERROR(RegisterSpatialFunctions(database.get()));
    HYPERMAP_RETURN_IF_ERROR(database->Execute("PRAGMA synchronous = FULL"));
    HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database.get()));
    HYPERMAP_RETURN_IF_ERROR(Rebuild(database.get(), std::move(names)));
    if (!was_written) HYPERMAP_RETURN_IF_ERROR(RecordSchema(database.get()));
    HYPERMAP_RETURN_IF_ERROR(transaction.Commit());
  }
  HYPERMAP_ASSIGN_OR_RETURN(report.after, CheckMapFile(path, evidence));
  return report;
}

}  // namespace hypermap::storage
