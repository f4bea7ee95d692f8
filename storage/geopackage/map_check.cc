#include "storage/geopackage/map_check.h"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "storage/encoding/geometry_blob.h"
#include "storage/finding_list.h"
#include "storage/geopackage/change_writer.h"
#include "storage/geopackage/damaged_pages.h"
#include "storage/geopackage/ends_if_cancelled.h"
#include "storage/geopackage/evidence_check.h"
#include "storage/geopackage/find_rows.h"
#include "storage/geopackage/for_table.h"
#include "storage/geopackage/foreign_writes.h"
#include "storage/geopackage/frame_table.h"
#include "storage/geopackage/geopackage_options.h"
#include "storage/geopackage/history_check.h"
#include "storage/geopackage/layer_table.h"
#include "storage/geopackage/map_file.h"
#include "storage/geopackage/map_metadata.h"
#include "storage/geopackage/schema.h"
#include "storage/geopackage/time_mark_table.h"
#include "storage/sqlite/durable_file.h"
#include "storage/sqlite/page_checksums.h"

namespace hypermap::storage {
namespace {

// $t stands for the name of a layer's table, which needs no escapes (IsLayerTableName).
constexpr char kVersionsOfNoRevision[] = R"sql(
SELECT 'id ' || id FROM "$t"
  WHERE version > (SELECT oldest_revision FROM hypermap_metadata)
    AND NOT EXISTS (SELECT 1 FROM hypermap_layer_revisions AS r
      WHERE r.lineage = ?1 AND r.revision = "$t".version)
)sql";
constexpr char kObjectsWithBoxes[] = R"sql(
SELECT f.id, f.geom, b.minx, b.miny, b.maxx, b.maxy
  FROM "$t" AS f LEFT JOIN "rtree_$t_geom" AS b ON b.id = f.id
)sql";
constexpr char kBoxesOfNoObject[] = R"sql(
SELECT 'id ' || b.id FROM "rtree_$t_geom" AS b
  WHERE NOT EXISTS (SELECT 1 FROM "$t" AS f WHERE f.id = b.id)
)sql";

// Returns whether two bounds differ by no more than the rounding to floats. Programs round in
// different ways.
bool IsNear(double a, double b) { return std::abs(a - b) <= 1e-6 * (1.0 + std::abs(b)); }

// Returns whether an index may have the box for a shape with the bounds `exact`.
bool Fits(const Box& box, const Box& exact) {
  return box.Covers(exact.min) && box.Covers(exact.max) && IsNear(box.min.x, exact.min.x) &&
         IsNear(box.min.y, exact.min.y) && IsNear(box.max.x, exact.max.x) &&
         IsNear(box.max.y, exact.max.y);
}

// A line of SQLite's integrity_check. An index that lacks rows of its table can be made again.
Finding FindingOfLine(absl::string_view line) {
  for (const absl::string_view words :
       {"missing from index ", "wrong # of entries in index ", "values differ from index "}) {
    const size_t at = line.find(words);
    if (at == absl::string_view::npos) continue;
    return {std::string(line.substr(at + words.size())), "", std::string(line), true};
  }
  return {"", "", std::string(line)};
}

class MapChecker {
 public:
  MapChecker(Database* database, const EvidenceCheck& evidence)
      : database_(database), evidence_(evidence) {}

  absl::StatusOr<CheckReport> Run();

 private:
  // FAILED_PRECONDITION if the file is none that can be checked. False if its damage, which is a
  // finding, leaves nothing more to check.
  absl::StatusOr<bool> CheckVersion();
  absl::Status CheckPages();
  absl::Status CheckRows();
  absl::Status CheckLayers();
  absl::Status CheckFeatures(const OpenLayer& layer);
  absl::Status CheckGrid(const OpenLayer& layer);
  absl::Status CheckIndex(const std::string& table);
  absl::Status CompareBoxes(const std::string& table, const std::string& index);
  // Adds a finding for each page, with the table or index to which it belongs.
  absl::Status AddFailedPages(const std::set<int64_t>& numbers);
  // Adds a finding for each line that the query answers, unless it is "ok".
  absl::Status AddLines(const std::string& sql, const std::string& index);

  Database* const database_;
  const EvidenceCheck& evidence_;
  FindingList findings_;
};

absl::StatusOr<CheckReport> MapChecker::Run() {
  const EndsIfCancelled ends(database_);
  HYPERMAP_ASSIGN_OR_RETURN(const ReadTransaction transaction, ReadTransaction::Begin(database_));
  HYPERMAP_ASSIGN_OR_RETURN(const bool is_map, CheckVersion());
  HYPERMAP_RETURN_IF_ERROR(CheckPages());
  if (is_map) HYPERMAP_RETURN_IF_ERROR(CheckRows());
  return std::move(findings_).Take();
}

absl::StatusOr<bool> MapChecker::CheckVersion() {
  const absl::StatusOr<int64_t> version = ReadSchemaVersion(database_);
  if (!version.ok()) {
    HYPERMAP_RETURN_IF_ERROR(findings_.AddDamage("hypermap_metadata", "", version.status()));
    return false;
  }
  HYPERMAP_RETURN_IF_ERROR(CheckIsOfThisVersion(*version));
  return true;
}

absl::Status MapChecker::AddLines(const std::string& sql, const std::string& index) {
  const FailedPages failed;
  HYPERMAP_ASSIGN_OR_RETURN(Statement check, database_->Prepare(sql));
  while (true) {
    const absl::StatusOr<bool> has_row = check.Step();
    if (!has_row.ok() && failed.numbers().empty()) return has_row.status();
    if (!has_row.ok() || !*has_row) break;
    for (const absl::string_view line : absl::StrSplit(check.Text(0), '\n', absl::SkipEmpty())) {
      if (line == "ok" || absl::StartsWith(line, "*** in database")) continue;
      if (IsReadError(line)) {
        if (failed.numbers().empty()) return absl::UnavailableError(line);
        continue;
      }
      findings_.Add(index.empty() ? FindingOfLine(line)
                                  : Finding{index, "", std::string(line), true});
    }
  }
  return AddFailedPages(failed.numbers());
}

absl::Status MapChecker::AddFailedPages(const std::set<int64_t>& numbers) {
  if (numbers.empty()) return absl::OkStatus();
  for (const std::string& page : DescribeFailedPages(database_->path(), numbers)) {
    findings_.Add({"", "", page});
  }
  return CheckCancelled();
}

absl::Status MapChecker::CheckPages() {
  return findings_.AddDamage(
      "", "",
      AddLines(absl::StrCat("PRAGMA integrity_check(", FindingList::kMaxFindings, ")"), ""));
}

absl::Status MapChecker::CheckRows() {
  HYPERMAP_RETURN_IF_ERROR(findings_.AddDamage("", "", VerifySchema(database_)));
  const absl::StatusOr<MapMetadata> metadata = ReadMetadata(database_);
  if (metadata.ok()) findings_.set_revision(metadata->revision);
  HYPERMAP_RETURN_IF_ERROR(findings_.AddDamage("hypermap_metadata", "", metadata.status()));
  HYPERMAP_RETURN_IF_ERROR(
      findings_.AddDamage("hypermap_frames", "", ReadFrames(database_).status()));
  HYPERMAP_RETURN_IF_ERROR(
      findings_.AddDamage("hypermap_time_marks", "", ReadTimeMarks(database_).status()));
  HYPERMAP_RETURN_IF_ERROR(findings_.AddDamage(kLayersTable, "", CheckLayers()));
  HYPERMAP_RETURN_IF_ERROR(CheckHistory(database_, &findings_));
  return CheckEvidenceLogs(database_, evidence_, &findings_);
}

absl::Status MapChecker::CheckLayers() {
  std::vector<StoredLayer> layers;
  {
    HYPERMAP_ASSIGN_OR_RETURN(Statement select,
                              database_->Prepare(absl::StrCat("SELECT ", kLayerColumns, " FROM ",
                                                              kLayersTable, " ORDER BY name")));
    while (true) {
      HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
      if (!has_row) break;
      absl::StatusOr<StoredLayer> layer = ReadLayerRow(&select);
      if (layer.ok()) {
        layers.push_back(*std::move(layer));
        continue;
      }
      // What Validate finds is damage, too.
      findings_.Add({kLayersTable, absl::StrCat("layer ", select.Text(0)),
                     std::string(layer.status().message())});
    }
  }
  for (StoredLayer& stored : layers) {
    const OpenLayer layer = MakeOpenLayer(database_, std::move(stored));
    HYPERMAP_RETURN_IF_ERROR(layer.grid != nullptr ? CheckGrid(layer) : CheckFeatures(layer));
  }
  return absl::OkStatus();
}

absl::Status MapChecker::CheckGrid(const OpenLayer& layer) {
  const std::string& table = layer.stored.table;
  const absl::Status status = layer.grid->ForEach(
      layer.stored.extent, [&](int64_t id, const absl::StatusOr<GridTable::PlacedTile>& tile) {
        return findings_.AddDamage(table, absl::StrCat("id ", id), tile.status());
      });
  return findings_.AddDamage(table, "", status);
}

absl::Status MapChecker::CheckFeatures(const OpenLayer& layer) {
  const std::string& table = layer.stored.table;
  const absl::Status status =
      layer.features->ForEach([&](ObjectId id, const absl::StatusOr<ObjectPtr>& object) {
        return findings_.AddDamage(table, absl::StrCat("id ", id), object.status());
      });
  HYPERMAP_RETURN_IF_ERROR(findings_.AddDamage(table, "", status));
  HYPERMAP_RETURN_IF_ERROR(
      FindRows(database_, {table, "", "its version is no revision that changed the layer"},
               &findings_, ForTable(kVersionsOfNoRevision, table), layer.stored.lineage));
  return CheckIndex(table);
}

absl::Status MapChecker::CheckIndex(const std::string& table) {
  const std::string index = ForTable("rtree_$t_geom", table);
  HYPERMAP_RETURN_IF_ERROR(findings_.AddDamage(index, "", CompareBoxes(table, index), true));
  HYPERMAP_RETURN_IF_ERROR(FindRows(database_,
                                    {index, "", "the index has an entry of no object", true},
                                    &findings_, ForTable(kBoxesOfNoObject, table)));
  // The nodes of the tree, which a search must reach.
  return findings_.AddDamage(
      index, "", AddLines(absl::StrCat("SELECT rtreecheck('main', '", index, "')"), index), true);
}

absl::Status MapChecker::CompareBoxes(const std::string& table, const std::string& index) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select,
                            database_->Prepare(ForTable(kObjectsWithBoxes, table)));
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return absl::OkStatus();
    const absl::StatusOr<Box> exact = BoxOfGeometryBlob(select.Blob(1));
    // A geometry that is damaged is a finding of its own row.
    if (!exact.ok() || exact->empty()) continue;
    const std::string row = absl::StrCat("id ", select.Int64(0));
    if (select.IsNull(2)) {
      findings_.Add({index, row, "the object is not in the index", true});
      continue;
    }
    const Box box{{select.Double(2), select.Double(3)}, {select.Double(4), select.Double(5)}};
    if (!Fits(box, *exact)) {
      findings_.Add({index, row, "the index has another box than the object", true});
    }
  }
}

}  // namespace

absl::StatusOr<CheckReport> CheckMap(Database* database, const EvidenceCheck& evidence) {
  return MapChecker(database, evidence).Run();
}

absl::StatusOr<CheckReport> CheckMapFile(const std::string& path, const EvidenceCheck& evidence) {
  if (!PathExists(path)) return absl::NotFoundError("there is no such file");
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return absl::FailedPreconditionError("not a regular file");
  }
  const Database::OpenMode mode = ModeForReading(path);
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<Database> database,
                            Database::Open(path, mode, GeoPackageOptions().busy_timeout));
  // What other programs wrote has no checksums before a server opens the file.
  std::optional<UnverifiedReads> unverified;
  if (WasWrittenByOthers(path)) unverified.emplace(database->handle());
  HYPERMAP_ASSIGN_OR_RETURN(CheckReport report, CheckMap(database.get(), evidence));
  // SQLite reads an incomplete last page as if it ended with zeros.
  const absl::StatusOr<std::optional<int64_t>> page_size = database->QueryInt64("PRAGMA page_size");
  const auto size = static_cast<int64_t>(std::filesystem::file_size(path, error));
  if (mode == Database::OpenMode::kFileAlone && !error && page_size.ok() &&
      size % page_size->value_or(1) != 0) {
    report.findings.push_back({"", "", "the file is cut short"});
  }
  return report;
}

}  // namespace hypermap::storage
