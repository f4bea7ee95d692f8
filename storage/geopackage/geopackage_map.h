// One map in one GeoPackage file.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_MAP_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_MAP_H_

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "storage/geopackage/change_writer.h"
#include "storage/geopackage/disk_reserve.h"
#include "storage/geopackage/fusion_tables.h"
#include "storage/geopackage/geopackage_options.h"
#include "storage/geopackage/map_metadata.h"
#include "storage/geopackage/open_files.h"
#include "storage/map_store.h"
#include "storage/sqlite/file_lock.h"
#include "storage/sqlite/revision_witness.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Other programs may read the file while it is open here. Changes that they make through SQLite are
// seen at the next opening; a file that they remove, replace or overwrite ends the map (OpenFiles).
class GeoPackageMap : public StoredMap {
 public:
  // Opens the file as the map `name`, whatever its name was at its creation: a map is renamed by
  // renaming its file. Holds `lock` until it is destroyed.
  static absl::StatusOr<std::unique_ptr<GeoPackageMap>> Open(const std::string& path,
                                                             const std::string& name, FileLock lock,
                                                             const GeoPackageOptions& options);
  // Opens a file that was just created, which therefore is the one that the store wrote last.
  static absl::StatusOr<std::unique_ptr<GeoPackageMap>> OpenNew(const std::string& path,
                                                                const std::string& name,
                                                                FileLock lock,
                                                                const GeoPackageOptions& options);
  // Moves the write-ahead log into the file, so that the file is the whole map, unless CheckFile
  // fails.
  ~GeoPackageMap() override;

  // Lets Compact use the reserve when the disk is full.
  void set_reserve(std::shared_ptr<DiskReserve> reserve) { reserve_ = std::move(reserve); }

  const MapHeader& header() const override { return header_; }
  std::vector<std::string> opening_notes() const override { return notes_; }
  absl::Status CheckFile() override { return InMap(files_->Check()); }
  absl::Status damage() const override { return InMap(damage_); }
  absl::StatusOr<SnapshotPtr> Load() override;
  absl::Status Write(absl::Span<const Commit> commits) override;
  absl::Status TryWrite() override;
  absl::StatusOr<std::optional<Receipt>> FindReceipt(absl::string_view request_id) override;
  absl::StatusOr<MapPosition> Position() override;
  absl::StatusOr<std::vector<TimedReceipt>> Receipts(absl::string_view after,
                                                     int max_count) override;
  absl::StatusOr<std::vector<TimeMark>> TimeMarks() override;
  absl::Status AddTimeMark(const TimeMark& mark, absl::Duration forget_before) override;
  absl::StatusOr<std::unique_ptr<HistoryReader>> OpenHistory() override;
  absl::StatusOr<bool> Compact(Revision oldest, absl::Time receipts_before, int max_rows) override;
  FusionLog& fusion_log() override { return fusion_; }
  absl::Status AddCopied(absl::Span<const TimedReceipt> receipts,
                         absl::Span<const FusionChange> fusion) override;
  absl::Status ClearCopied() override;
  absl::Status FinishCopy() override;
  absl::StatusOr<int64_t> BackupBytes() override;
  absl::StatusOr<std::unique_ptr<MapBackup>> OpenBackup() override;
  absl::StatusOr<std::unique_ptr<MapCheck>> OpenCheck() override;

 private:
  // The parts of a map that Open has made and read.
  struct Opened {
    std::unique_ptr<Database> database;
    std::unique_ptr<OpenFiles> files;
    MapMetadata metadata;
    OpenLayers layers;
    RevisionWitness witness;
    std::vector<std::string> notes;
    absl::Status damage;
  };

  GeoPackageMap(FileLock lock, const GeoPackageOptions& options, Opened opened);

  static absl::StatusOr<Opened> OpenFile(const std::string& path, const FileLock& lock, bool is_new,
                                         const GeoPackageOptions& options);
  static absl::StatusOr<std::unique_ptr<GeoPackageMap>> Make(const std::string& name, FileLock lock,
                                                             const GeoPackageOptions& options,
                                                             absl::StatusOr<Opened> opened);

  // Reads a layer into `snapshot`, or lists it as damaged.
  absl::Status AddLayer(const OpenLayer& open, Snapshot* snapshot) const;
  // Raises `next_id` above the ids of the layer's objects.
  absl::StatusOr<LayerPtr> LoadLayer(const OpenLayer& open, ObjectId* next_id) const;
  absl::StatusOr<SnapshotPtr> LoadSnapshot();
  absl::Status WriteAll(absl::Span<const Commit> commits);
  absl::Status WriteChecked(absl::Span<const Commit> commits);
  // Writes the witness of the newest revision.
  void KeepWitness(const Commit& newest);
  // Writes witness_ to the lock file; also to the disk, unless that has one of this opening.
  absl::Status WriteWitness();
  absl::StatusOr<bool> CompactSome(Revision oldest, absl::Time receipts_before, int max_rows);
  absl::Status WriteNothing();
  // Runs `write` in a durable transaction. FAILED_PRECONDITION if the map is no unfinished copy.
  absl::Status WriteToCopy(absl::FunctionRef<absl::Status()> write);
  absl::Status WriteTimeMark(const TimeMark& mark, absl::Duration forget_before);
  // Adds the name of the map to an error.
  absl::Status InMap(const absl::Status& status) const;

  FileLock lock_;
  std::unique_ptr<Database> database_;
  std::unique_ptr<OpenFiles> files_;
  MapHeader header_;
  RevisionWitness witness_;
  bool has_witness_ = false;          // the lock file has it
  bool has_durable_witness_ = false;  // one was synced since the map was opened
  std::vector<std::string> notes_;
  const absl::Status damage_;
  const absl::Duration busy_timeout_;
  const CacheRoomPtr cache_room_;
  Revision revision_;
  Revision oldest_revision_;
  OpenLayers layers_;
  FusionTables fusion_;
  std::shared_ptr<DiskReserve> reserve_;  // may be null
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_MAP_H_
