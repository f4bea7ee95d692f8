#include "storage/geopackage/geopackage_map.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"
#include "storage/geopackage/compaction.h"
#include "storage/geopackage/frame_table.h"
#include "storage/geopackage/geopackage_history.h"
#include "storage/geopackage/layer_history.h"
#include "storage/geopackage/map_file.h"
#include "storage/geopackage/revision_table.h"
#include "storage/geopackage/time_mark_table.h"
#include "storage/sqlite/durable_file.h"

namespace hypermap::storage {
namespace {

absl::Status About(const std::string& map, const absl::Status& status) {
  if (status.ok()) return status;
  return absl::Status(status.code(), absl::StrCat("map ", map, ": ", status.message()));
}

// A statement that only reads fails with INTERNAL if a table does not have the columns that it was
// created with: the file is damaged.
absl::Status AsDamage(const absl::Status& status) {
  if (status.code() != absl::StatusCode::kInternal) return status;
  return absl::DataLossError(status.message());
}

}  // namespace

GeoPackageMap::GeoPackageMap(FileLock lock, std::unique_ptr<Database> database,
                             absl::Duration busy_timeout, MapMetadata metadata, OpenLayers layers)
    : lock_(std::move(lock)),
      database_(std::move(database)),
      header_(std::move(metadata.header)),
      busy_timeout_(busy_timeout),
      revision_(metadata.revision),
      oldest_revision_(metadata.oldest_revision),
      layers_(std::move(layers)),
      fusion_(database_.get()) {}

GeoPackageMap::~GeoPackageMap() {
  // Closing does this, too, but not while another program has the file open.
  database_->Execute("PRAGMA wal_checkpoint(TRUNCATE)").IgnoreError();
}

absl::StatusOr<std::unique_ptr<StoredMap>> GeoPackageMap::Open(const std::string& path,
                                                               const std::string& name,
                                                               FileLock lock,
                                                               const GeoPackageOptions& options) {
  absl::StatusOr<std::unique_ptr<Database>> database = OpenMapFile(path, options);
  if (!database.ok()) return About(name, database.status());
  absl::StatusOr<MapMetadata> metadata = ReadMetadata(database->get());
  if (!metadata.ok()) return About(name, AsDamage(metadata.status()));
  metadata->header.name = name;
  absl::StatusOr<std::vector<StoredLayer>> stored = ReadLayers(database->get());
  if (!stored.ok()) return About(name, AsDamage(stored.status()));
  OpenLayers layers;
  for (StoredLayer& layer : *stored) {
    const std::string layer_name = layer.spec.name;
    layers.emplace(layer_name, MakeOpenLayer(database->get(), std::move(layer)));
  }
  return std::unique_ptr<StoredMap>(new GeoPackageMap(std::move(lock), *std::move(database),
                                                      options.busy_timeout, *std::move(metadata),
                                                      std::move(layers)));
}

absl::Status GeoPackageMap::InMap(const absl::Status& status) const {
  return About(header_.name, status);
}

absl::StatusOr<SnapshotPtr> GeoPackageMap::Load() {
  absl::StatusOr<SnapshotPtr> snapshot = LoadSnapshot();
  // Frees the page cache: the pages that were read last are not the ones that the next edits need.
  sqlite3_db_release_memory(database_->handle());
  if (!snapshot.ok()) return InMap(AsDamage(snapshot.status()));
  return snapshot;
}

absl::StatusOr<LayerPtr> GeoPackageMap::LoadLayer(const OpenLayer& open, ObjectId* next_id) const {
  const StoredLayer& stored = open.stored;
  if (open.grid != nullptr) {
    HYPERMAP_ASSIGN_OR_RETURN(TileMap tiles, open.grid->ReadAll(stored.extent));
    return std::make_shared<GridLayer>(stored.spec, MakeCellDomain(stored.spec), std::move(tiles),
                                       stored.extent);
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<ObjectPtr> objects, open.features->ReadAll());
  // Another program may have added objects with ids of its own.
  if (!objects.empty()) *next_id = std::max(*next_id, objects.back()->id + 1);
  return std::make_shared<SemanticLayer>(stored.spec, std::move(objects));
}

absl::StatusOr<SnapshotPtr> GeoPackageMap::LoadSnapshot() {
  auto snapshot = std::make_shared<Snapshot>();
  HYPERMAP_ASSIGN_OR_RETURN(MapMetadata metadata, ReadMetadata(database_.get()));
  snapshot->map_name = header_.name;
  snapshot->frame_id = metadata.header.frame_id;
  snapshot->revision = metadata.revision;
  snapshot->next_object_id = metadata.next_object_id;
  HYPERMAP_ASSIGN_OR_RETURN(FrameTree frames, ReadFrames(database_.get()));
  snapshot->frames = std::move(frames);
  for (const auto& [name, open] : layers_) {
    HYPERMAP_ASSIGN_OR_RETURN(LayerPtr layer, LoadLayer(open, &snapshot->next_object_id));
    snapshot->layers.emplace(name, std::move(layer));
    HYPERMAP_ASSIGN_OR_RETURN(const Revision version,
                              NewestRevisionOf(database_.get(), open.stored.lineage));
    snapshot->layer_versions.emplace(name, version);
  }
  return snapshot;
}

absl::Status GeoPackageMap::Write(absl::Span<const Commit> commits) {
  return commits.empty() ? absl::OkStatus() : InMap(WriteAll(commits));
}

absl::Status GeoPackageMap::WriteAll(absl::Span<const Commit> commits) {
  const Snapshot& newest = *commits.back().applied.snapshot;
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database_.get()));
  ChangeWriter writer(database_.get(), layers_);
  for (const Commit& commit : commits) {
    HYPERMAP_RETURN_IF_ERROR(writer.Write(commit));
  }
  absl::Status status = writer.Finish(newest);
  if (status.ok()) {
    status = AdvanceRevision(database_.get(), revision_, newest.revision, newest.next_object_id);
  }
  if (status.ok()) status = transaction.Commit();
  HYPERMAP_RETURN_IF_ERROR(status);
  layers_ = std::move(writer).TakeLayers();
  revision_ = newest.revision;
  return absl::OkStatus();
}

absl::StatusOr<std::optional<Receipt>> GeoPackageMap::FindReceipt(absl::string_view request_id) {
  absl::StatusOr<std::optional<Receipt>> receipt = ReadReceipt(database_.get(), request_id);
  if (!receipt.ok()) return InMap(receipt.status());
  return receipt;
}

absl::StatusOr<std::vector<TimeMark>> GeoPackageMap::TimeMarks() {
  absl::StatusOr<std::vector<TimeMark>> marks = ReadTimeMarks(database_.get());
  if (!marks.ok()) return InMap(AsDamage(marks.status()));
  return marks;
}

absl::Status GeoPackageMap::AddTimeMark(const TimeMark& mark, absl::Duration forget_before) {
  return InMap(WriteTimeMark(mark, forget_before));
}

absl::Status GeoPackageMap::WriteTimeMark(const TimeMark& mark, absl::Duration forget_before) {
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database_.get()));
  HYPERMAP_RETURN_IF_ERROR(InsertTimeMark(database_.get(), mark, forget_before));
  return transaction.Commit();
}

absl::StatusOr<std::unique_ptr<HistoryReader>> GeoPackageMap::OpenHistory() {
  // Any thread may call this: it uses only members that never change.
  return GeoPackageHistory::Open(database_->path(), header_.name, busy_timeout_);
}

absl::StatusOr<bool> GeoPackageMap::Compact(Revision oldest, absl::Time receipts_before,
                                            int max_rows) {
  absl::StatusOr<bool> more = CompactSome(std::min(oldest, revision_), receipts_before, max_rows);
  if (!more.ok()) return InMap(more.status());
  return more;
}

absl::StatusOr<bool> GeoPackageMap::CompactSome(Revision oldest, absl::Time receipts_before,
                                                int max_rows) {
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database_.get()));
  if (oldest > oldest_revision_) {
    HYPERMAP_RETURN_IF_ERROR(SetOldestRevision(database_.get(), oldest));
  }
  const Revision kept = std::max(oldest, oldest_revision_);
  absl::StatusOr<bool> more = RemoveForgotten(database_.get(), kept, receipts_before, max_rows);
  if (!more.ok()) return more;
  HYPERMAP_RETURN_IF_ERROR(transaction.Commit());
  oldest_revision_ = kept;
  return more;
}

absl::Status GeoPackageMap::BackupTo(const std::string& path) { return InMap(WriteBackup(path)); }

absl::Status GeoPackageMap::WriteBackup(const std::string& path) {
  if (PathExists(path)) return absl::AlreadyExistsError(absl::StrCat(path, " exists"));
  const std::string temporary = absl::StrCat(path, ".new");
  absl::Status status = RemoveFile(temporary);
  // VACUUM INTO writes a compact copy in one file, without a write-ahead log.
  if (status.ok()) status = database_->Run("VACUUM INTO ?", temporary);
  if (status.ok()) status = PublishFile(temporary, path);
  if (!status.ok()) RemoveFile(temporary).IgnoreError();
  return status;
}

}  // namespace hypermap::storage
