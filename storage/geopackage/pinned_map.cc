#include "storage/geopackage/pinned_map.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_spec.h"
#include "storage/geopackage/fusion_tables.h"
#include "storage/geopackage/geopackage_history.h"
#include "storage/geopackage/map_metadata.h"
#include "storage/geopackage/revision_table.h"
#include "storage/geopackage/schema.h"
#include "storage/geopackage/time_mark_table.h"
#include "storage/sqlite/durable_file.h"
#include "storage/sqlite/sqlite.h"
#include "storage/unfinished_copy.h"

namespace hypermap::storage {
namespace {

class PinnedMap : public ReadableMap {
 public:
  PinnedMap(std::unique_ptr<Database> database, ReadTransaction transaction, MapMetadata metadata,
            const GeoPackageOptions& options)
      : options_(options),
        database_(std::move(database)),
        transaction_(std::move(transaction)),
        metadata_(std::move(metadata)),
        fusion_(database_.get()) {}

  const MapHeader& header() const override { return metadata_.header; }
  absl::StatusOr<MapPosition> Position() override { return PositionOf(metadata_); }
  absl::StatusOr<std::vector<TimedReceipt>> Receipts(absl::string_view after,
                                                     int max_count) override {
    return InMap(ReadReceipts(database_.get(), after, max_count));
  }
  absl::StatusOr<std::vector<TimeMark>> TimeMarks() override {
    return InMap(ReadTimeMarks(database_.get()));
  }
  FusionLog& fusion_log() override { return fusion_; }
  absl::StatusOr<std::unique_ptr<HistoryReader>> OpenHistory() override {
    return GeoPackageHistory::Open(database_->path(), metadata_.header.name, options_.busy_timeout,
                                   options_.cache_room);
  }

 private:
  template <typename T>
  absl::StatusOr<T> InMap(absl::StatusOr<T> result) const {
    if (!result.ok()) return HistoryStatus(metadata_.header.name, result.status());
    return result;
  }

  const GeoPackageOptions options_;
  const std::unique_ptr<Database> database_;
  const ReadTransaction transaction_;
  const MapMetadata metadata_;
  FusionTables fusion_;
};

class GeoPackageReader : public MapStore {
 public:
  explicit GeoPackageReader(std::string folder) : folder_(std::move(folder)) {}

  absl::StatusOr<std::vector<std::string>> List() override { return MapsInFolder(folder_); }
  absl::StatusOr<std::unique_ptr<ReadableMap>> Pin(const std::string& name) override {
    return PinGeoPackage(folder_, name, GeoPackageOptions());
  }
  absl::StatusOr<std::unique_ptr<StoredMap>> Create(const MapHeader& /*header*/) override {
    return ForReading();
  }
  absl::StatusOr<std::unique_ptr<StoredMap>> Open(const std::string& /*name*/) override {
    return ForReading();
  }
  std::string FileStamp(const std::string& /*name*/) override { return ""; }
  absl::Status Delete(const std::string& /*name*/, const std::string& /*request_id*/) override {
    return ForReading();
  }
  absl::StatusOr<std::optional<std::string>> FindDeletion(
      const std::string& /*request_id*/) override {
    return ForReading();
  }

 private:
  absl::Status ForReading() const {
    return absl::FailedPreconditionError(
        absl::StrCat("the folder ", folder_, " is open for reading only"));
  }

  const std::string folder_;
};

}  // namespace

absl::StatusOr<std::vector<std::string>> FileNamesIn(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  std::filesystem::directory_iterator entry(folder, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    names.push_back(entry->path().filename().string());
  }
  if (error) return absl::UnavailableError(absl::StrCat(folder, ": ", error.message()));
  std::sort(names.begin(), names.end());
  return names;
}

absl::StatusOr<std::vector<std::string>> MapsInFolder(const std::string& folder) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> files, FileNamesIn(folder));
  std::vector<std::string> maps;
  for (absl::string_view file : files) {
    if (!absl::ConsumeSuffix(&file, kMapExtension)) continue;
    if (ValidateName("map", file).ok()) maps.emplace_back(file);
  }
  std::sort(maps.begin(), maps.end());
  return maps;
}

absl::StatusOr<std::unique_ptr<ReadableMap>> PinGeoPackage(const std::string& folder,
                                                           const std::string& name,
                                                           const GeoPackageOptions& options) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", name));
  const std::string path = absl::StrCat(folder, "/", name, kMapExtension);
  HYPERMAP_ASSIGN_OR_RETURN(const bool found, FindPath(path));
  if (!found) return absl::NotFoundError(absl::StrCat("no map ", name));
  const auto pin = [&]() -> absl::StatusOr<std::unique_ptr<ReadableMap>> {
    HYPERMAP_ASSIGN_OR_RETURN(
        std::unique_ptr<Database> database,
        Database::Open(path, Database::OpenMode::kReadOnly, options.busy_timeout));
    HYPERMAP_ASSIGN_OR_RETURN(ReadTransaction transaction, ReadTransaction::Begin(database.get()));
    HYPERMAP_ASSIGN_OR_RETURN(const int64_t version, ReadSchemaVersion(database.get()));
    HYPERMAP_RETURN_IF_ERROR(CheckIsOfThisVersion(version));
    HYPERMAP_ASSIGN_OR_RETURN(MapMetadata metadata, ReadMetadata(database.get()));
    metadata.header.name = name;
    return std::make_unique<PinnedMap>(std::move(database), std::move(transaction),
                                       std::move(metadata), options);
  };
  absl::StatusOr<std::unique_ptr<ReadableMap>> pinned = pin();
  if (!pinned.ok()) return HistoryStatus(name, pinned.status());
  const MapHeader& header = (*pinned)->header();
  if (header.unfinished_copy) return UnfinishedCopyError(name);
  if (header.provisional) return absl::NotFoundError(absl::StrCat("no map ", name));
  return pinned;
}

absl::StatusOr<std::unique_ptr<MapStore>> OpenGeoPackageReader(const std::string& folder) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    return absl::NotFoundError(absl::StrCat("no folder ", folder));
  }
  return std::make_unique<GeoPackageReader>(folder);
}

}  // namespace hypermap::storage
