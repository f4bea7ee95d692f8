#include "storage/geopackage/geopackage_history.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "absl/strings/str_cat.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "base/text/utf8.h"
#include "storage/encoding/change_columns.h"
#include "storage/geopackage/layer_history.h"

namespace hypermap::storage {
namespace {

// The part of the file that the page cache of a reader holds at most. It is small because there may
// be many readers: what they read is kept decoded within the CacheRoom, and pages that are read
// again are in the page cache of the system.
constexpr int kPageCacheKib = 256;

constexpr char kCommitChanges[] =
    "SELECT revision, kind, lineage, object_id, tile_column, tile_row, detail FROM "
    "hypermap_changes WHERE revision BETWEEN ? AND ? ORDER BY revision, number";

// An author may have bytes that are not UTF-8, which version 0.1 accepted but no message can carry.
RevisionRecord ReadRecord(Statement* row) {
  return {row->Int64(0), absl::FromUnixNanos(row->Int64(1)), ReplaceInvalidUtf8(row->Text(2)),
          row->Int64(3)};
}

int64_t BytesOf(const RevisionRecord& record) {
  return static_cast<int64_t>(sizeof record + record.author.size());
}

}  // namespace

absl::Status HistoryStatus(const std::string& map, const absl::Status& status) {
  if (status.ok() || absl::IsResourceExhausted(status)) return status;
  const absl::StatusCode code =
      status.code() == absl::StatusCode::kInternal ? absl::StatusCode::kDataLoss : status.code();
  return absl::Status(code, absl::StrCat("map ", map, ": ", status.message()));
}

GeoPackageHistory::GeoPackageHistory(std::unique_ptr<Database> database, std::string map_name,
                                     const CacheRoomPtr& cache_room)
    : database_(std::move(database)),
      map_name_(std::move(map_name)),
      objects_(database_.get(), cache_room),
      tiles_(database_.get(), cache_room),
      structures_(cache_room, kMaxStructureBytes) {}

absl::StatusOr<std::unique_ptr<HistoryReader>> GeoPackageHistory::Open(const std::string& path,
                                                                       const std::string& map_name,
                                                                       absl::Duration busy_timeout,
                                                                       CacheRoomPtr cache_room) {
  absl::StatusOr<std::unique_ptr<Database>> database =
      Database::Open(path, Database::OpenMode::kReadOnly, busy_timeout);
  if (!database.ok()) return HistoryStatus(map_name, database.status());
  const absl::Status limited =
      (*database)->Execute(absl::StrCat("PRAGMA cache_size = -", kPageCacheKib));
  if (!limited.ok()) return HistoryStatus(map_name, limited);
  std::unique_ptr<GeoPackageHistory> history(
      new GeoPackageHistory(*std::move(database), map_name, cache_room));
  // SQLite opens the file at the first read. This read makes that happen now, while the writer has
  // the file open.
  HYPERMAP_RETURN_IF_ERROR(history->Kept().status());
  return history;
}

absl::StatusOr<KeptRevisions> GeoPackageHistory::Kept() {
  absl::StatusOr<MapMetadata> metadata = ReadMetadata(database_.get());
  if (!metadata.ok()) return HistoryStatus(map_name_, metadata.status());
  return KeptRevisions{metadata->oldest_revision, metadata->revision};
}

absl::StatusOr<MapMetadata> GeoPackageHistory::CheckKept(Revision revision) {
  absl::StatusOr<MapMetadata> metadata = ReadMetadata(database_.get());
  if (!metadata.ok()) return HistoryStatus(map_name_, metadata.status());
  if (revision < metadata->oldest_revision) {
    return absl::OutOfRangeError(absl::StrCat("map ", map_name_, ": revision ", revision,
                                              " is not kept; the oldest is ",
                                              metadata->oldest_revision));
  }
  if (revision > metadata->revision) {
    return absl::OutOfRangeError(absl::StrCat("map ", map_name_, ": there is no revision ",
                                              revision, " yet; the newest is ",
                                              metadata->revision));
  }
  return metadata;
}

absl::StatusOr<absl::Time> GeoPackageHistory::TimeOf(const MapMetadata& metadata,
                                                     Revision revision) {
  if (revision == 0) return metadata.header.created_at;
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> time,
      database_->QueryInt64("SELECT time_ns FROM hypermap_revisions WHERE revision = ?", revision));
  if (!time) {
    return absl::DataLossError(absl::StrCat("hypermap_revisions has no revision ", revision));
  }
  return absl::FromUnixNanos(*time);
}

absl::StatusOr<Revision> GeoPackageHistory::RevisionAt(absl::Time time) {
  absl::StatusOr<ReadTransaction> transaction = ReadTransaction::Begin(database_.get());
  if (!transaction.ok()) return HistoryStatus(map_name_, transaction.status());
  absl::StatusOr<MapMetadata> metadata = ReadMetadata(database_.get());
  if (!metadata.ok()) return HistoryStatus(map_name_, metadata.status());
  absl::StatusOr<absl::Time> oldest = TimeOf(*metadata, metadata->oldest_revision);
  if (!oldest.ok()) return HistoryStatus(map_name_, oldest.status());
  if (*oldest > time) {
    return absl::OutOfRangeError(absl::StrCat(
        "map ", map_name_, ": the oldest kept revision ", metadata->oldest_revision,
        " was made at ", absl::FormatTime(absl::RFC3339_full, *oldest, absl::UTCTimeZone())));
  }
  // The times of revisions never decrease, so that a binary search needs no index.
  Revision low = metadata->oldest_revision;
  Revision high = metadata->revision;
  while (low < high) {
    const Revision middle = high - (high - low) / 2;
    absl::StatusOr<absl::Time> made = TimeOf(*metadata, middle);
    if (!made.ok()) return HistoryStatus(map_name_, made.status());
    if (*made <= time) {
      low = middle;
    } else {
      high = middle - 1;
    }
  }
  return low;
}

absl::StatusOr<PastStructurePtr> GeoPackageHistory::StructureAt(const MapMetadata& metadata,
                                                                Revision revision) {
  if (PastStructurePtr known = structures_.Find(revision)) return known;
  absl::StatusOr<PastStructurePtr> structure =
      ReadStructure(database_.get(), map_name_, metadata.header.frame_id, revision);
  if (structure.ok()) {
    structures_.Insert(revision, *structure,
                       1024 + UnsharedBytes(*(*structure)->map, MapStructure()));
  }
  return structure;
}

absl::StatusOr<std::unique_ptr<PastMap>> GeoPackageHistory::At(Revision revision) {
  absl::StatusOr<ReadTransaction> transaction = ReadTransaction::Begin(database_.get());
  if (!transaction.ok()) return HistoryStatus(map_name_, transaction.status());
  HYPERMAP_ASSIGN_OR_RETURN(MapMetadata metadata, CheckKept(revision));
  absl::StatusOr<PastStructurePtr> structure = StructureAt(metadata, revision);
  if (!structure.ok()) return HistoryStatus(map_name_, structure.status());
  return std::make_unique<GeoPackagePastMap>(*std::move(transaction), database_.get(), &objects_,
                                             &tiles_, *std::move(structure));
}

absl::StatusOr<std::vector<RevisionRecord>> GeoPackageHistory::ReadRevisions(Revision after,
                                                                             Revision before,
                                                                             bool newest_first,
                                                                             int64_t max_count) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select, database_->Prepare(absl::StrCat(
                            "SELECT revision, time_ns, author, num_changes FROM hypermap_revisions "
                            "WHERE revision > ? AND revision < ? ORDER BY revision ",
                            newest_first ? "DESC" : "ASC", " LIMIT ?")));
  select.Bind(after, before, max_count);
  std::vector<RevisionRecord> records;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return records;
    records.push_back(ReadRecord(&select));
    HYPERMAP_RETURN_IF_ERROR(select.row_status());
    HYPERMAP_RETURN_IF_ERROR(TakeMemory(BytesOf(records.back())));
  }
}

absl::StatusOr<std::vector<RevisionRecord>> GeoPackageHistory::Revisions(Revision after,
                                                                         Revision before,
                                                                         bool newest_first,
                                                                         int max_count) {
  absl::StatusOr<ReadTransaction> transaction = ReadTransaction::Begin(database_.get());
  if (!transaction.ok()) return HistoryStatus(map_name_, transaction.status());
  HYPERMAP_ASSIGN_OR_RETURN(KeptRevisions kept, Kept());
  absl::StatusOr<std::vector<RevisionRecord>> records =
      ReadRevisions(std::max(after, kept.oldest - 1), before, newest_first, std::max(max_count, 0));
  if (!records.ok()) return HistoryStatus(map_name_, records.status());
  return records;
}

absl::StatusOr<std::vector<PastCommit>> GeoPackageHistory::Commits(Revision after,
                                                                   int max_changes) {
  absl::StatusOr<ReadTransaction> transaction = ReadTransaction::Begin(database_.get());
  if (!transaction.ok()) return HistoryStatus(map_name_, transaction.status());
  HYPERMAP_RETURN_IF_ERROR(CheckKept(after).status());
  absl::StatusOr<std::vector<PastCommit>> commits = ReadCommits(after, max_changes);
  if (!commits.ok()) return HistoryStatus(map_name_, commits.status());
  return commits;
}

absl::StatusOr<std::vector<PastCommit>> GeoPackageHistory::ReadCommits(Revision after,
                                                                       int max_changes) {
  // Also bounds the number of commits that have no changes.
  std::vector<RevisionRecord> records;
  {
    // Charged for the moment only: most callers keep the changes alone.
    const TemporaryMemory temporary;
    HYPERMAP_ASSIGN_OR_RETURN(records,
                              ReadRevisions(after, std::numeric_limits<Revision>::max(),
                                            /*newest_first=*/false, std::max(max_changes, 1)));
  }
  std::vector<PastCommit> commits;
  int64_t room = max_changes;
  for (RevisionRecord& record : records) {
    room -= record.num_changes;
    if (!commits.empty() && room < 0) break;
    PastCommit& commit = commits.emplace_back();
    commit.changes.reserve(std::clamp<int64_t>(record.num_changes, 0, 65536));
    commit.record = std::move(record);
  }
  if (commits.empty()) return commits;
  HYPERMAP_RETURN_IF_ERROR(AddChanges(&commits));
  for (const PastCommit& commit : commits) {
    if (commit.record.num_changes == static_cast<int64_t>(commit.changes.size())) continue;
    return absl::DataLossError(absl::StrCat("hypermap_changes has ", commit.changes.size(),
                                            " changes of revision ", commit.record.revision,
                                            ", not ", commit.record.num_changes));
  }
  return commits;
}

absl::Status GeoPackageHistory::AddChanges(std::vector<PastCommit>* commits) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, database_->Prepare(kCommitChanges));
  select.Bind(commits->front().record.revision, commits->back().record.revision);
  Lineages lineages;
  auto commit = commits->begin();
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return absl::OkStatus();
    HYPERMAP_ASSIGN_OR_RETURN(LoggedChange logged, ReadLoggedChange(&select));
    while (commit != commits->end() && commit->record.revision < logged.revision) ++commit;
    if (commit == commits->end() || commit->record.revision != logged.revision) {
      return absl::DataLossError(
          absl::StrCat("hypermap_revisions has no revision ", logged.revision));
    }
    absl::StatusOr<Change> change = ToChange(logged, &lineages);
    if (!change.ok()) {
      return absl::Status(change.status().code(),
                          absl::StrCat("hypermap_changes, revision ", logged.revision, ": ",
                                       change.status().message()));
    }
    commit->changes.push_back(*std::move(change));
  }
}

absl::StatusOr<Change> GeoPackageHistory::ToChange(const LoggedChange& logged, Lineages* lineages) {
  if (logged.lineage == 0) return DecodeStructureChange(logged.kind, logged.detail, LayerSpec());
  auto lineage = lineages->find(logged.lineage);
  if (lineage == lineages->end()) {
    HYPERMAP_ASSIGN_OR_RETURN(Lineage read, ReadLineage(database_.get(), logged.lineage));
    lineage = lineages->emplace(logged.lineage, std::move(read)).first;
  }
  const Lineage& layer = lineage->second;
  const std::string& name = layer.stored.spec.name;
  const Revision revision = logged.revision;
  if (logged.kind == kTileWritten) {
    HYPERMAP_ASSIGN_OR_RETURN(TilePtr before, tiles_.At(layer, logged.tile, revision - 1));
    HYPERMAP_ASSIGN_OR_RETURN(TilePtr after, tiles_.At(layer, logged.tile, revision));
    if (after == nullptr || !IsInMatrix(logged.tile)) {
      return absl::DataLossError("a tile that is not there");
    }
    return Change(TileWritten{name, FromMatrix(logged.tile), std::move(before), std::move(after)});
  }
  const bool is_put = logged.kind == kObjectPut;
  if (!is_put && logged.kind != kObjectRemoved)
    return DecodeStructureChange(logged.kind, logged.detail, layer.stored.spec);
  HYPERMAP_ASSIGN_OR_RETURN(ObjectPtr before, objects_.At(layer, logged.object_id, revision - 1));
  if (!is_put) {
    if (before == nullptr) return absl::DataLossError("removes an object that was not there");
    return Change(ObjectRemoved{name, std::move(before)});
  }
  HYPERMAP_ASSIGN_OR_RETURN(ObjectPtr after, objects_.At(layer, logged.object_id, revision));
  if (after == nullptr) return absl::DataLossError("puts an object that is not there");
  return Change(ObjectPut{name, std::move(before), std::move(after)});
}

}  // namespace hypermap::storage
