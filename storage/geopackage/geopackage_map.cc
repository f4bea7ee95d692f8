#include "storage/geopackage/geopackage_map.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"
#include "storage/geopackage/backup.h"
#include "storage/geopackage/compaction.h"
#include "storage/geopackage/foreign_writes.h"
#include "storage/geopackage/frame_table.h"
#include "storage/geopackage/geopackage_history.h"
#include "storage/geopackage/layer_history.h"
#include "storage/geopackage/map_check.h"
#include "storage/geopackage/map_file.h"
#include "storage/geopackage/map_opening.h"
#include "storage/geopackage/revision_table.h"
#include "storage/geopackage/time_mark_table.h"
#include "storage/incarnation.h"

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

class OpenMapCheck : public MapCheck {
 public:
  OpenMapCheck(std::string name, std::unique_ptr<Database> reader)
      : name_(std::move(name)), reader_(std::move(reader)) {}

  absl::StatusOr<CheckReport> Run(const EvidenceCheck& evidence) override {
    absl::StatusOr<CheckReport> report = CheckMap(reader_.get(), evidence);
    if (!report.ok()) return About(name_, report.status());
    return report;
  }

 private:
  const std::string name_;
  const std::unique_ptr<Database> reader_;
};

}  // namespace

GeoPackageMap::GeoPackageMap(FileLock lock, const GeoPackageOptions& options, Opened opened)
    : lock_(std::move(lock)),
      database_(std::move(opened.database)),
      files_(std::move(opened.files)),
      header_(std::move(opened.metadata.header)),
      witness_(opened.witness),
      notes_(std::move(opened.notes)),
      damage_(std::move(opened.damage)),
      busy_timeout_(options.busy_timeout),
      cache_room_(options.cache_room),
      revision_(opened.metadata.revision),
      oldest_revision_(opened.metadata.oldest_revision),
      layers_(std::move(opened.layers)),
      fusion_(database_.get()) {
  // Writing it for the first time takes the space that later ones overwrite. Without a witness the
  // map is another incarnation when it is opened again, which does no harm. The next commit tries
  // again.
  const absl::Status status = WriteWitness();
  if (!status.ok()) {
    notes_.push_back(absl::StrCat("the newest revision is not recorded: ", status.message()));
  }
}

GeoPackageMap::~GeoPackageMap() {
  // Closing moves the log into the file, too, but not while another program has the file open.
  files_->Finish();
  if (!has_witness_) lock_.Write(EncodeWitness(witness_)).IgnoreError();
}

absl::StatusOr<std::unique_ptr<GeoPackageMap>> GeoPackageMap::Open(
    const std::string& path, const std::string& name, FileLock lock,
    const GeoPackageOptions& options) {
  absl::StatusOr<Opened> opened = OpenFile(path, lock, /*is_new=*/false, options);
  return Make(name, std::move(lock), options, std::move(opened));
}

absl::StatusOr<std::unique_ptr<GeoPackageMap>> GeoPackageMap::OpenNew(
    const std::string& path, const std::string& name, FileLock lock,
    const GeoPackageOptions& options) {
  absl::StatusOr<Opened> opened = OpenFile(path, lock, /*is_new=*/true, options);
  return Make(name, std::move(lock), options, std::move(opened));
}

absl::StatusOr<std::unique_ptr<GeoPackageMap>> GeoPackageMap::Make(const std::string& name,
                                                                   FileLock lock,
                                                                   const GeoPackageOptions& options,
                                                                   absl::StatusOr<Opened> opened) {
  if (!opened.ok()) return About(name, opened.status());
  opened->metadata.header.name = name;
  std::unique_ptr<GeoPackageMap> map(
      new GeoPackageMap(std::move(lock), options, *std::move(opened)));
  for (std::string& note : map->notes_) note = absl::StrCat("map ", name, ": ", note);
  return map;
}

absl::StatusOr<GeoPackageMap::Opened> GeoPackageMap::OpenFile(const std::string& path,
                                                              const FileLock& lock, bool is_new,
                                                              const GeoPackageOptions& options) {
  std::optional<RevisionWitness> witness;
  bool set_aside = false;
  if (!is_new) {
    HYPERMAP_ASSIGN_OR_RETURN(witness, ReadWitness(lock));
    HYPERMAP_ASSIGN_OR_RETURN(set_aside, SetForeignLogAside(path, witness));
  }
  Opened opened;
  HYPERMAP_ASSIGN_OR_RETURN(OpenMap file, OpenMapFile(path, options));
  opened.database = std::move(file.database);
  opened.damage = std::move(file.damage);
  Database* const database = opened.database.get();
  absl::StatusOr<MapMetadata> metadata = ReadMetadata(database);
  if (!metadata.ok()) return AsDamage(metadata.status());
  absl::StatusOr<std::vector<StoredLayer>> stored = ReadLayers(database);
  if (!stored.ok()) return AsDamage(stored.status());
  for (StoredLayer& layer : *stored) {
    const std::string layer_name = layer.spec.name;
    opened.layers.emplace(layer_name, MakeOpenLayer(database, std::move(layer)));
  }
  absl::StatusOr<OpenedHistory> history =
      is_new ? BeginHistory(database, *metadata) : ContinueHistory(database, witness, &*metadata);
  if (!history.ok()) return AsDamage(history.status());
  opened.metadata = *std::move(metadata);
  opened.witness = history->witness;
  opened.notes = std::move(history->notes);
  if (file.was_written_by_others) {
    opened.notes.push_back(
        "another program has written to the file, or moved its write-ahead log into it: all pages "
        "were checked, and those that it wrote have new checksums");
  }
  if (!file.older_copy.empty()) {
    opened.notes.push_back(
        absl::StrCat("the file had an older schema, and was migrated; as it was, it is kept as ",
                     file.older_copy));
  }
  if (set_aside) {
    opened.notes.push_back(
        absl::StrCat("the write-ahead log beside the file belongs to another file, and was renamed "
                     "to ",
                     OrphanPathOf(path)));
  }
  HYPERMAP_ASSIGN_OR_RETURN(opened.files, OpenFiles::Attach(database));
  // Last, because what fails before it leaves no record of a closing.
  HYPERMAP_RETURN_IF_ERROR(RecordOpening(database));
  return opened;
}

absl::Status GeoPackageMap::InMap(const absl::Status& status) const {
  return About(header_.name, status);
}

absl::StatusOr<SnapshotPtr> GeoPackageMap::Load() {
  absl::StatusOr<SnapshotPtr> snapshot = LoadSnapshot();
  // The statements and pages that were used last are not the ones that the next edits need.
  database_->ForgetStatements();
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

absl::Status GeoPackageMap::AddLayer(const OpenLayer& open, Snapshot* snapshot) const {
  const StoredLayer& stored = open.stored;
  const std::string& name = stored.spec.name;
  const absl::StatusOr<LayerPtr> layer = LoadLayer(open, &snapshot->next_object_id);
  const absl::Status status = InMap(AsDamage(layer.status()));
  if (layer.ok()) {
    snapshot->layers.emplace(name, *layer);
  } else if (absl::IsDataLoss(status)) {
    snapshot->damaged.emplace(
        name, DamagedLayer{MakeEmptyLayer(LayerStructure{stored.spec, stored.extent}),
                           absl::DataLossError(
                               absl::StrCat("layer ", name, " is damaged: ", status.message()))});
  } else {
    return layer.status();
  }
  HYPERMAP_ASSIGN_OR_RETURN(const Revision version,
                            NewestRevisionOf(database_.get(), stored.lineage));
  snapshot->layer_versions.emplace(name, version);
  return absl::OkStatus();
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
    HYPERMAP_RETURN_IF_ERROR(AddLayer(open, snapshot.get()));
  }
  return snapshot;
}

absl::Status GeoPackageMap::Write(absl::Span<const Commit> commits) {
  return commits.empty() ? absl::OkStatus() : InMap(WriteChecked(commits));
}

absl::Status GeoPackageMap::WriteChecked(absl::Span<const Commit> commits) {
  HYPERMAP_RETURN_IF_ERROR(files_->Check());
  absl::Status status = WriteAll(commits);
  // Commits that went to a file that was replaced meanwhile must not be acknowledged; and that is
  // the reason, if writing failed. That nothing can be told at the moment is no reason to deny
  // commits that are durable.
  // A commit has looked at the files when it was written.
  absl::Status check = status.ok() ? files_->problem() : files_->Check();
  if (absl::IsDataLoss(check)) return check;
  if (status.ok()) KeepWitness(commits.back());
  return status;
}

void GeoPackageMap::KeepWitness(const Commit& newest) {
  witness_.revision = revision_;
  witness_.time_ns = absl::ToUnixNanos(newest.time);
  // If this fails, the witness stays older than the file: a loss may go unnoticed, but the commits
  // are durable.
  WriteWitness().IgnoreError();
}

absl::Status GeoPackageMap::WriteWitness() {
  absl::Status status = lock_.Write(EncodeWitness(witness_));
  // Later ones overwrite it. A power loss keeps one of them.
  if (status.ok() && !has_durable_witness_) status = lock_.Sync();
  has_witness_ = status.ok();
  has_durable_witness_ = has_durable_witness_ || status.ok();
  return status;
}

absl::Status GeoPackageMap::WriteAll(absl::Span<const Commit> commits) {
  const Snapshot& newest = *commits.back().applied.snapshot;
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database_.get()));
  HYPERMAP_RETURN_IF_ERROR(BeginOwnWrites(database_.get()));
  ChangeWriter writer(database_.get(), layers_);
  for (const Commit& commit : commits) {
    HYPERMAP_RETURN_IF_ERROR(writer.Write(commit));
  }
  absl::Status status = writer.Finish(newest);
  if (status.ok() && writer.has_changed_schema()) status = RecordSchema(database_.get());
  if (status.ok()) {
    status = AdvanceRevision(database_.get(), revision_, newest.revision, newest.next_object_id);
  }
  if (status.ok()) status = transaction.Commit();
  HYPERMAP_RETURN_IF_ERROR(status);
  layers_ = std::move(writer).TakeLayers();
  revision_ = newest.revision;
  return absl::OkStatus();
}

absl::Status GeoPackageMap::TryWrite() { return InMap(WriteNothing()); }

absl::Status GeoPackageMap::WriteNothing() {
  HYPERMAP_RETURN_IF_ERROR(files_->Check());
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database_.get()));
  // Writes a page, although it has the same content.
  HYPERMAP_RETURN_IF_ERROR(BeginOwnWrites(database_.get()));
  return transaction.Commit();
}

absl::StatusOr<std::optional<Receipt>> GeoPackageMap::FindReceipt(absl::string_view request_id) {
  absl::StatusOr<std::optional<Receipt>> receipt = ReadReceipt(database_.get(), request_id);
  if (!receipt.ok()) return InMap(receipt.status());
  return receipt;
}

absl::StatusOr<MapPosition> GeoPackageMap::Position() {
  const absl::StatusOr<MapMetadata> metadata = ReadMetadata(database_.get());
  if (!metadata.ok()) return InMap(AsDamage(metadata.status()));
  return PositionOf(*metadata);
}

absl::StatusOr<std::vector<TimedReceipt>> GeoPackageMap::Receipts(absl::string_view after,
                                                                  int max_count) {
  absl::StatusOr<std::vector<TimedReceipt>> receipts =
      ReadReceipts(database_.get(), after, max_count);
  if (!receipts.ok()) return InMap(AsDamage(receipts.status()));
  return receipts;
}

absl::Status GeoPackageMap::WriteToCopy(absl::FunctionRef<absl::Status()> write) {
  if (!header_.unfinished_copy) {
    return absl::FailedPreconditionError("the map is no unfinished copy");
  }
  HYPERMAP_RETURN_IF_ERROR(files_->Check());
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database_.get()));
  HYPERMAP_RETURN_IF_ERROR(write());
  return transaction.Commit();
}

absl::Status GeoPackageMap::AddCopied(absl::Span<const TimedReceipt> receipts,
                                      absl::Span<const FusionChange> fusion) {
  return InMap(WriteToCopy([&]() -> absl::Status {
    for (const TimedReceipt& receipt : receipts) {
      HYPERMAP_RETURN_IF_ERROR(InsertReceipt(database_.get(), receipt));
    }
    for (const FusionChange& change : fusion) {
      HYPERMAP_RETURN_IF_ERROR(WriteFusionChange(database_.get(), change));
    }
    return absl::OkStatus();
  }));
}

absl::Status GeoPackageMap::ClearCopied() {
  return InMap(WriteToCopy([&]() -> absl::Status {
    HYPERMAP_RETURN_IF_ERROR(
        database_->Execute("DELETE FROM hypermap_receipts; DELETE FROM hypermap_time_marks"));
    return DropAllFusion(database_.get());
  }));
}

absl::Status GeoPackageMap::FinishCopy() {
  HYPERMAP_RETURN_IF_ERROR(InMap(WriteToCopy([&] { return SetComplete(database_.get()); })));
  header_.unfinished_copy = false;
  return absl::OkStatus();
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
  HYPERMAP_RETURN_IF_ERROR(files_->Check());
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database_.get()));
  HYPERMAP_RETURN_IF_ERROR(InsertTimeMark(database_.get(), mark, forget_before));
  return transaction.Commit();
}

absl::StatusOr<std::unique_ptr<HistoryReader>> GeoPackageMap::OpenHistory() {
  // Any thread may call this: it uses only members that never change.
  HYPERMAP_RETURN_IF_ERROR(InMap(files_->CheckIdentity()));
  absl::StatusOr<std::unique_ptr<HistoryReader>> reader =
      GeoPackageHistory::Open(database_->path(), header_.name, busy_timeout_, cache_room_);
  // Again, because the reader opened the file by its name, which may be another file's by now.
  HYPERMAP_RETURN_IF_ERROR(InMap(files_->CheckIdentity()));
  return reader;
}

absl::StatusOr<bool> GeoPackageMap::Compact(Revision oldest, absl::Time receipts_before,
                                            int max_rows) {
  absl::StatusOr<bool> more = false;
  const auto compact = [&] {
    more = CompactSome(std::min(oldest, revision_), receipts_before, max_rows);
    return more.status();
  };
  absl::Status status =
      reserve_ ? reserve_->Use(DiskReserve::Purpose::kHistory, compact) : compact();
  HYPERMAP_RETURN_IF_ERROR(InMap(status));
  if (reserve_ && !*more) reserve_->Keep();
  return more;
}

absl::StatusOr<bool> GeoPackageMap::CompactSome(Revision oldest, absl::Time receipts_before,
                                                int max_rows) {
  HYPERMAP_RETURN_IF_ERROR(files_->Check());
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

absl::StatusOr<int64_t> GeoPackageMap::BackupBytes() {
  // With the pages that are still in the write-ahead log. A copy has no free pages.
  int64_t values[3];
  const char* const names[] = {"page_count", "freelist_count", "page_size"};
  for (int i = 0; i < 3; ++i) {
    const absl::StatusOr<std::optional<int64_t>> value =
        database_->QueryInt64(absl::StrCat("PRAGMA ", names[i]));
    if (!value.ok()) return InMap(value.status());
    values[i] = value->value_or(0);
  }
  const auto [num_pages, num_free, page_bytes] = values;
  return (num_pages - num_free) * page_bytes;
}

absl::StatusOr<std::unique_ptr<MapBackup>> GeoPackageMap::OpenBackup() {
  HYPERMAP_RETURN_IF_ERROR(InMap(files_->Check()));
  absl::StatusOr<std::unique_ptr<MapBackup>> backup =
      OpenGeoPackageBackup(header_.name, database_->path(), busy_timeout_);
  if (!backup.ok()) return InMap(backup.status());
  // Again, because the backup opened the files by their names, which may be other files' by now.
  HYPERMAP_RETURN_IF_ERROR(InMap(files_->Check()));
  return backup;
}

absl::StatusOr<std::unique_ptr<MapCheck>> GeoPackageMap::OpenCheck() {
  HYPERMAP_RETURN_IF_ERROR(InMap(files_->Check()));
  absl::StatusOr<std::unique_ptr<Database>> reader =
      Database::Open(database_->path(), Database::OpenMode::kReadOnly, busy_timeout_);
  if (!reader.ok()) return InMap(reader.status());
  // SQLite opens the files when it reads for the first time.
  HYPERMAP_RETURN_IF_ERROR(
      InMap((*reader)->QueryInt64("SELECT count(*) FROM sqlite_schema").status()));
  // Again, as OpenBackup does.
  HYPERMAP_RETURN_IF_ERROR(InMap(files_->Check()));
  return std::make_unique<OpenMapCheck>(header_.name, *std::move(reader));
}

}  // namespace hypermap::storage
