// One map in one GeoPackage file.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_MAP_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_MAP_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/geopackage/change_writer.h"
#include "storage/geopackage/fusion_tables.h"
#include "storage/geopackage/geopackage_options.h"
#include "storage/geopackage/map_metadata.h"
#include "storage/map_store.h"
#include "storage/sqlite/file_lock.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Other programs may read the file while it is open here. Their changes are seen at the next
// opening.
class GeoPackageMap : public StoredMap {
 public:
  // Opens the file as the map `name`, whatever its name was at its creation: a map is renamed by
  // renaming its file. Holds `lock` until it is destroyed.
  static absl::StatusOr<std::unique_ptr<StoredMap>> Open(const std::string& path,
                                                         const std::string& name, FileLock lock,
                                                         const GeoPackageOptions& options);
  // Moves the write-ahead log into the file, so that the file is the whole map.
  ~GeoPackageMap() override;

  const MapHeader& header() const override { return header_; }
  absl::StatusOr<SnapshotPtr> Load() override;
  absl::Status Write(absl::Span<const Commit> commits) override;
  absl::StatusOr<std::optional<Receipt>> FindReceipt(absl::string_view request_id) override;
  absl::StatusOr<std::vector<TimeMark>> TimeMarks() override;
  absl::Status AddTimeMark(const TimeMark& mark, absl::Duration forget_before) override;
  absl::StatusOr<std::unique_ptr<HistoryReader>> OpenHistory() override;
  absl::StatusOr<bool> Compact(Revision oldest, absl::Time receipts_before, int max_rows) override;
  FusionLog& fusion_log() override { return fusion_; }
  absl::Status BackupTo(const std::string& path) override;

 private:
  GeoPackageMap(FileLock lock, std::unique_ptr<Database> database, absl::Duration busy_timeout,
                MapMetadata metadata, OpenLayers layers);

  // Raises `next_id` above the ids of the layer's objects.
  absl::StatusOr<LayerPtr> LoadLayer(const OpenLayer& open, ObjectId* next_id) const;
  absl::StatusOr<SnapshotPtr> LoadSnapshot();
  absl::Status WriteAll(absl::Span<const Commit> commits);
  absl::StatusOr<bool> CompactSome(Revision oldest, absl::Time receipts_before, int max_rows);
  absl::Status WriteTimeMark(const TimeMark& mark, absl::Duration forget_before);
  absl::Status WriteBackup(const std::string& path);
  // Adds the name of the map to an error.
  absl::Status InMap(const absl::Status& status) const;

  FileLock lock_;
  std::unique_ptr<Database> database_;
  MapHeader header_;
  const absl::Duration busy_timeout_;
  Revision revision_;
  Revision oldest_revision_;
  OpenLayers layers_;
  FusionTables fusion_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_MAP_H_
