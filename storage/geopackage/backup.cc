#include "storage/geopackage/backup.h"

#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/ends_if_cancelled.h"
#include "storage/geopackage/foreign_writes.h"
#include "storage/geopackage/map_file.h"
#include "storage/geopackage/map_metadata.h"
#include "storage/incarnation.h"
#include "storage/sqlite/durable_file.h"
#include "storage/sqlite/paced_writes.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {
namespace {

// A copy of a map goes on with a history of its own. A copy for which this fails is of no use, so
// it is changed in place.
absl::Status GiveNewIncarnation(const std::string& path, absl::Duration busy_timeout) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<Database> copy,
                            Database::Open(path, Database::OpenMode::kExisting, busy_timeout));
  HYPERMAP_RETURN_IF_ERROR(
      copy->Execute("PRAGMA journal_mode = MEMORY; PRAGMA synchronous = OFF;"));
  HYPERMAP_RETURN_IF_ERROR(SetIncarnation(copy.get(), NewIncarnation()));
  return RecordCopy(copy.get());
}

class GeoPackageBackup : public MapBackup {
 public:
  GeoPackageBackup(std::string name, std::unique_ptr<Database> reader, absl::Duration busy_timeout)
      : name_(std::move(name)), reader_(std::move(reader)), busy_timeout_(busy_timeout) {}

  absl::Status WriteTo(const std::string& path) override {
    absl::Status status = Write(path);
    if (status.ok()) return status;
    return absl::Status(status.code(), absl::StrCat("map ", name_, ": ", status.message()));
  }

 private:
  absl::Status Write(const std::string& path) {
    if (PathExists(path)) return absl::AlreadyExistsError(absl::StrCat(path, " exists"));
    // VACUUM INTO writes a compact copy in one file, without a write-ahead log.
    const UnpacedWrites unpaced;
    absl::Status status;
    {
      const EndsIfCancelled ends(reader_.get());
      status = reader_->Run("VACUUM INTO ?", path);
      // SQLite's own error says only that it was interrupted.
      if (absl::Status wanted = CheckCancelled(); !wanted.ok()) status = std::move(wanted);
    }
    if (status.ok()) status = GiveNewIncarnation(path, busy_timeout_);
    if (!status.ok()) RemoveMapFile(path).IgnoreError();
    return status;
  }

  const std::string name_;
  const std::unique_ptr<Database> reader_;
  const absl::Duration busy_timeout_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MapBackup>> OpenGeoPackageBackup(const std::string& name,
                                                                const std::string& path,
                                                                absl::Duration busy_timeout) {
  // A connection of its own, because a copy is synced as the connection's own file would be.
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<Database> reader,
                            Database::Open(path, Database::OpenMode::kReadOnly, busy_timeout));
  HYPERMAP_RETURN_IF_ERROR(
      reader->Execute("PRAGMA synchronous = OFF; PRAGMA cache_size = -16384;"));
  // SQLite opens the log when it reads for the first time.
  HYPERMAP_RETURN_IF_ERROR(reader->QueryInt64("SELECT count(*) FROM sqlite_schema").status());
  return std::make_unique<GeoPackageBackup>(name, std::move(reader), busy_timeout);
}

}  // namespace hypermap::storage
