#include "storage/geopackage/geopackage_store.h"

#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "storage/geopackage/deletion_log.h"
#include "storage/geopackage/disk_reserve.h"
#include "storage/geopackage/geopackage_map.h"
#include "storage/geopackage/map_check.h"
#include "storage/geopackage/map_file.h"
#include "storage/geopackage/pinned_map.h"
#include "storage/geopackage/trash.h"
#include "storage/incarnation.h"
#include "storage/sqlite/durable_file.h"
#include "storage/sqlite/file_lock.h"
#include "storage/unfinished_copy.h"

namespace hypermap::storage {
namespace {

constexpr absl::string_view kExtension = kMapExtension;

class GeoPackageStore : public MapStore {
 public:
  GeoPackageStore(std::string data_dir, const GeoPackageOptions& options, FileLock lock,
                  std::unique_ptr<DeletionLog> deletions)
      : data_dir_(std::move(data_dir)),
        options_(options),
        lock_(std::move(lock)),
        reserve_(std::make_shared<DiskReserve>(absl::StrCat(data_dir_, "/reserve"),
                                               options.reserve_bytes)),
        deletions_(std::move(deletions)),
        trash_(absl::StrCat(data_dir_, "/trash"), options.trash_age) {}

  // Completes the creations and deletions that a crash has interrupted.
  absl::Status Recover();

  absl::StatusOr<std::vector<std::string>> List() override;
  absl::StatusOr<std::unique_ptr<StoredMap>> Create(const MapHeader& header) override;
  absl::StatusOr<std::unique_ptr<StoredMap>> Open(const std::string& name) override;
  absl::StatusOr<std::unique_ptr<StoredMap>> OpenUnfinishedCopy(const std::string& name) override;
  absl::StatusOr<std::unique_ptr<ReadableMap>> Pin(const std::string& name) override {
    return PinGeoPackage(data_dir_, name, options_);
  }
  std::string FileStamp(const std::string& name) override;
  absl::Status Delete(const std::string& name, const std::string& request_id) override {
    return Remove(name, request_id, options_.trash_age > absl::ZeroDuration());
  }
  absl::Status Discard(const std::string& name) override {
    return Remove(name, /*request_id=*/"", /*keep=*/false);
  }
  absl::Status RemoveOldTrash(absl::Time now) override;
  absl::StatusOr<CheckReport> CheckFile(const std::string& path,
                                        const EvidenceCheck& evidence) override;
  absl::Status Restore(const std::string& path, const std::string& name,
                       const std::string& request_id) override;
  absl::StatusOr<std::optional<std::string>> FindDeletion(const std::string& request_id) override;

 private:
  std::string PathOf(const std::string& name) const {
    return absl::StrCat(data_dir_, "/", name, kExtension);
  }
  std::string HiddenPathOf(const std::string& name, absl::string_view suffix) const {
    return absl::StrCat(data_dir_, "/.", name, kExtension, suffix);
  }
  // Makes the file of an empty map. On error there is none.
  absl::StatusOr<FileLock> MakeLockedFile(const MapHeader& header);
  // Removes a map that was just made but can't be opened, because nobody was told that it exists.
  // Returns `status`, with the problem if the map can't be removed.
  absl::Status RemoveFailed(const std::string& name, const absl::Status& status)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // FAILED_PRECONDITION if there is a map of the name of the one that the request has deleted.
  absl::Status CheckGone(const std::string& name, const std::string& request_id) const;
  // Puts a file in the place of that of a map, which has no log. At every moment there is one of
  // the two maps. The earlier one goes to the trash.
  absl::Status Replace(const std::string& path, const std::string& name);
  absl::StatusOr<FileLock> LockMap(const std::string& name) const;
  enum class Sort { kMap, kUnfinishedCopy };
  // FAILED_PRECONDITION if the file is of the other sort; it is not touched then.
  absl::StatusOr<std::unique_ptr<GeoPackageMap>> OpenAs(const std::string& name, Sort sort);
  // FAILED_PRECONDITION if the map's file is another name of the file of a map that is open, or a
  // symbolic link: SQLite puts the log beside the link's target.
  absl::Status CheckSingle(const std::string& name) const;
  // Deletes a map. `keep`: it goes to the trash.
  absl::Status Remove(const std::string& name, const std::string& request_id, bool keep);
  absl::Status CarryOut(int64_t deletion, const std::string& name, bool keep)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Removes the files of a map, or moves them to the trash.
  absl::Status RemoveFiles(int64_t deletion, const std::string& name, bool keep)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Makes the reserve whole. Deleted maps give way to it, the oldest first.
  void MakeRoom() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Completes deletions of a map whose file is gone, which an error has interrupted. Otherwise the
  // next start would carry them out on a new map of that name. REQUIRES: there is no such map.
  absl::Status CompleteDeletions(const std::string& name) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::string data_dir_;
  const GeoPackageOptions options_;
  const FileLock lock_;
  const std::shared_ptr<DiskReserve> reserve_;
  // Held while maps are added or removed and the deletions are used.
  Mutex mutex_;
  const std::unique_ptr<DeletionLog> deletions_ ABSL_PT_GUARDED_BY(mutex_);
  Trash trash_ ABSL_GUARDED_BY(mutex_);
};

absl::Status GeoPackageStore::Recover() {
  const MutexLock lock(&mutex_);
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<std::string> names, FileNamesIn(data_dir_));
  for (const std::string& name : names) {
    if (!absl::StartsWith(name, ".")) continue;
    if (!absl::EndsWith(name, ".gpkg.new") && !absl::EndsWith(name, ".gpkg.new-journal")) continue;
    const std::string path = absl::StrCat(data_dir_, "/", name);
    HYPERMAP_RETURN_IF_ERROR(RemoveFile(path));
  }
  // A lock without a map is left by a creation that was killed. One with a witness stays: it tells
  // which revision a map was at that somebody has moved away and may bring back.
  for (const std::string& name : names) {
    absl::string_view map = name;
    if (!absl::ConsumePrefix(&map, ".") || !absl::ConsumeSuffix(&map, ".gpkg.lock")) continue;
    if (PathExists(PathOf(std::string(map)))) continue;
    absl::StatusOr<FileLock> map_lock = LockMap(std::string(map));
    if (!map_lock.ok()) continue;
    const absl::StatusOr<std::string> witness = map_lock->Read(1);
    if (witness.ok() && witness->empty()) map_lock->RemoveFile().IgnoreError();
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<DeletionLog::Pending> pending, deletions_->FindPending());
  for (const auto& [deletion, map] : pending) {
    if (!ValidateName("map", map).ok()) {
      return absl::DataLossError(absl::StrCat(data_dir_, "/catalog.sqlite names a map ", map));
    }
    HYPERMAP_RETURN_IF_ERROR(CarryOut(deletion, map, trash_.keeps_maps()));
  }
  HYPERMAP_RETURN_IF_ERROR(trash_.RemoveLinksTo(data_dir_));
  MakeRoom();
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::string>> GeoPackageStore::List() { return MapsInFolder(data_dir_); }

absl::StatusOr<std::unique_ptr<StoredMap>> GeoPackageStore::Create(const MapHeader& header) {
  absl::Status status = ValidateName("map", header.name);
  if (status.ok()) status = ValidateFrameId("frame_id", header.frame_id);
  HYPERMAP_RETURN_IF_ERROR(status);
  HYPERMAP_ASSIGN_OR_RETURN(FileLock lock, MakeLockedFile(header));
  absl::StatusOr<std::unique_ptr<GeoPackageMap>> map =
      GeoPackageMap::OpenNew(PathOf(header.name), header.name, std::move(lock), options_);
  if (!map.ok()) {
    const MutexLock locked(&mutex_);
    return RemoveFailed(header.name, map.status());
  }
  (*map)->set_reserve(reserve_);
  return *std::move(map);
}

absl::StatusOr<FileLock> GeoPackageStore::MakeLockedFile(const MapHeader& header) {
  const std::string path = PathOf(header.name);
  const MutexLock lock(&mutex_);
  HYPERMAP_ASSIGN_OR_RETURN(const bool exists, FindPath(path));
  if (exists) return absl::AlreadyExistsError(absl::StrCat("map ", header.name, " exists"));
  HYPERMAP_RETURN_IF_ERROR(CompleteDeletions(header.name));
  // Before the file, so that the lack of one more open file is noticed while there is no map.
  HYPERMAP_ASSIGN_OR_RETURN(FileLock map_lock, LockMap(header.name));
  MapHeader made = header;
  if (made.incarnation == 0) made.incarnation = NewIncarnation();
  const absl::Status status = CreateMapFile(path, HiddenPathOf(made.name, ".new"), made, options_);
  if (status.ok()) return map_lock;
  // A file that somebody else has put there meanwhile stays.
  if (absl::IsAlreadyExists(status)) return status;
  return RemoveFailed(
      header.name, absl::Status(status.code(), absl::StrCat("cannot create map ", header.name, ": ",
                                                            status.message())));
}

absl::Status GeoPackageStore::RemoveFailed(const std::string& name, const absl::Status& status) {
  const absl::Status removed = RemoveMapFile(PathOf(name));
  if (PathExists(PathOf(name))) {
    return absl::Status(
        status.code(),
        absl::StrCat(status.message(), "; and the new map stays: ", removed.message()));
  }
  RemoveFile(HiddenPathOf(name, ".lock")).IgnoreError();
  return status;
}

absl::StatusOr<FileLock> GeoPackageStore::LockMap(const std::string& name) const {
  absl::StatusOr<FileLock> lock = FileLock::Acquire(HiddenPathOf(name, ".lock"));
  if (lock.status().code() != absl::StatusCode::kFailedPrecondition) return lock;
  return absl::FailedPreconditionError(
      absl::StrCat("map ", name, " is open: ", lock.status().message()));
}

absl::Status GeoPackageStore::CheckSingle(const std::string& name) const {
  const std::string path = PathOf(name);
  std::error_code error;
  if (std::filesystem::is_symlink(path, error)) {
    return absl::FailedPreconditionError(absl::StrCat(path, " is a symbolic link"));
  }
  // Usually a map's file has one name, and the folder need not be looked through.
  if (std::filesystem::hard_link_count(path, error) <= 1) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> files, FileNamesIn(data_dir_));
  for (const std::string& file : files) {
    absl::string_view other = file;
    if (!absl::ConsumeSuffix(&other, kExtension) || other == name) continue;
    if (!std::filesystem::equivalent(path, PathOf(std::string(other)), error)) continue;
    if (LockMap(std::string(other)).ok()) continue;  // It is not open.
    return absl::FailedPreconditionError(absl::StrCat(path, " is the same file as ", file));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<GeoPackageMap>> GeoPackageStore::OpenAs(const std::string& name,
                                                                       Sort sort) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", name));
  const std::string path = PathOf(name);
  HYPERMAP_ASSIGN_OR_RETURN(const bool found, FindPath(path));
  if (!found) return absl::NotFoundError(absl::StrCat("no map ", name));
  HYPERMAP_RETURN_IF_ERROR(CheckSingle(name));
  HYPERMAP_ASSIGN_OR_RETURN(FileLock lock, LockMap(name));
  const bool is_copy = IsUnfinishedCopy(path);
  if (is_copy && sort == Sort::kMap) return UnfinishedCopyError(name);
  if (!is_copy && sort == Sort::kUnfinishedCopy) {
    return absl::FailedPreconditionError(absl::StrCat("map ", name, " is no unfinished copy"));
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<GeoPackageMap> map,
                            GeoPackageMap::Open(path, name, std::move(lock), options_));
  map->set_reserve(reserve_);
  return map;
}

absl::StatusOr<std::unique_ptr<StoredMap>> GeoPackageStore::Open(const std::string& name) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<GeoPackageMap> map, OpenAs(name, Sort::kMap));
  if (!map->header().provisional) return map;
  map.reset();
  HYPERMAP_RETURN_IF_ERROR(RemoveMapFile(PathOf(name)));
  // The lock is of no use any more, and does no harm if it stays.
  if (absl::StatusOr<FileLock> left = LockMap(name); left.ok()) left->RemoveFile().IgnoreError();
  return absl::NotFoundError(absl::StrCat("the creation of map ", name, " was not completed"));
}

absl::StatusOr<std::unique_ptr<StoredMap>> GeoPackageStore::OpenUnfinishedCopy(
    const std::string& name) {
  return OpenAs(name, Sort::kUnfinishedCopy);
}

std::string GeoPackageStore::FileStamp(const std::string& name) {
  struct stat status;
  if (stat(PathOf(name).c_str(), &status) != 0) return "";
  return absl::StrCat(status.st_dev, " ", status.st_ino, " ", status.st_size, " ",
                      absl::ToUnixNanos(absl::TimeFromTimespec(status.st_mtim)));
}

absl::Status GeoPackageStore::RemoveOldTrash(absl::Time now) {
  const MutexLock lock(&mutex_);
  MakeRoom();
  return trash_.RemoveOld(now);
}

void GeoPackageStore::MakeRoom() {
  while (!reserve_->HasRoom() && trash_.RemoveOldest().ok()) {
  }
}

absl::Status GeoPackageStore::Remove(const std::string& name, const std::string& request_id,
                                     bool keep) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", name));
  const MutexLock lock(&mutex_);
  const bool exists = PathExists(PathOf(name));
  if (!exists) HYPERMAP_RETURN_IF_ERROR(CompleteDeletions(name));
  HYPERMAP_ASSIGN_OR_RETURN(std::optional<std::string> deleted, deletions_->Find(request_id));
  if (deleted.has_value()) {
    if (*deleted == name) return CheckGone(name, request_id);
    return absl::InvalidArgumentError(
        absl::StrCat("request_id ", request_id, " was used to delete map ", *deleted));
  }
  if (!exists) return absl::NotFoundError(absl::StrCat("no map ", name));
  std::unique_ptr<FileLock> map_lock;
  int64_t deletion = 0;
  absl::Status status = reserve_->Use(DiskReserve::Purpose::kDeletion, [&]() -> absl::Status {
    mutex_.AssertHeld();
    map_lock.reset();
    HYPERMAP_ASSIGN_OR_RETURN(FileLock locked, LockMap(name));
    map_lock = std::make_unique<FileLock>(std::move(locked));
    HYPERMAP_ASSIGN_OR_RETURN(deletion, deletions_->Begin(request_id, name));
    return absl::OkStatus();
  });
  if (status.ok()) status = CarryOut(deletion, name, keep);
  MakeRoom();
  HYPERMAP_RETURN_IF_ERROR(status);
  return map_lock->RemoveFile();
}

absl::Status GeoPackageStore::CheckGone(const std::string& name,
                                        const std::string& request_id) const {
  if (!PathExists(PathOf(name))) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("request_id \"", request_id, "\" deleted an earlier map \"", name,
                   "\"; the present one was made since and is not deleted"));
}

absl::Status GeoPackageStore::RemoveFiles(int64_t deletion, const std::string& name, bool keep) {
  if (!keep) return RemoveMapFile(PathOf(name));
  // The folder of a deleted map takes a block.
  return reserve_->Use(DiskReserve::Purpose::kDeletion, [&] {
    mutex_.AssertHeld();
    return trash_.Take(PathOf(name), name, deletion);
  });
}

absl::Status GeoPackageStore::CarryOut(int64_t deletion, const std::string& name, bool keep) {
  if (absl::Status status = RemoveFiles(deletion, name, keep); !status.ok()) {
    // If the map still exists, the deletion is cancelled: the caller gets an error, and so the map
    // must not be deleted at a later start.
    if (PathExists(PathOf(name))) deletions_->Cancel(deletion).IgnoreError();
    return status;
  }
  return reserve_->Use(DiskReserve::Purpose::kDeletion, [&] {
    mutex_.AssertHeld();
    return deletions_->Finish(deletion);
  });
}

absl::Status GeoPackageStore::CompleteDeletions(const std::string& name) {
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<DeletionLog::Pending> pending, deletions_->FindPending());
  for (const auto& [deletion, map] : pending) {
    if (map == name) HYPERMAP_RETURN_IF_ERROR(CarryOut(deletion, map, trash_.keeps_maps()));
  }
  return absl::OkStatus();
}

absl::StatusOr<CheckReport> GeoPackageStore::CheckFile(const std::string& path,
                                                       const EvidenceCheck& evidence) {
  HYPERMAP_RETURN_IF_ERROR(MigrateMapFile(path, options_));
  return CheckMapFile(path, evidence);
}

absl::Status GeoPackageStore::Restore(const std::string& path, const std::string& name,
                                      const std::string& request_id) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", name));
  HYPERMAP_ASSIGN_OR_RETURN(const bool exists, FindPath(PathOf(name)));
  // An attempt that could not sync the folder may have left the file as the map, and the map before
  // as the file.
  if (exists && WasMadeBy(PathOf(name), request_id)) return SyncFolder(data_dir_);
  HYPERMAP_RETURN_IF_ERROR(MarkRestored(path, request_id, options_));
  // SQLite would apply the log of the earlier map to the file.
  const bool has_log = PathExists(LogPathOf(PathOf(name))) || PathExists(PathOf(name) + "-journal");
  if (exists && !has_log) return Replace(path, name);
  if (exists) HYPERMAP_RETURN_IF_ERROR(Delete(name, /*request_id=*/""));
  const MutexLock lock(&mutex_);
  HYPERMAP_RETURN_IF_ERROR(CompleteDeletions(name));
  {
    // Without a witness the file becomes another incarnation when it is opened. One is left if a
    // person has moved the map's file away.
    HYPERMAP_ASSIGN_OR_RETURN(FileLock map_lock, LockMap(name));
    HYPERMAP_RETURN_IF_ERROR(map_lock.RemoveFile());
  }
  // SQLite would apply the log of an earlier map of this name to the file.
  HYPERMAP_RETURN_IF_ERROR(RemoveSidecars(PathOf(name)));
  return PublishFile(path, PathOf(name));
}

absl::Status GeoPackageStore::Replace(const std::string& path, const std::string& name) {
  const MutexLock lock(&mutex_);
  HYPERMAP_ASSIGN_OR_RETURN(FileLock map_lock, LockMap(name));
  // A deletion that could be neither carried out nor cancelled is of the earlier map.
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<DeletionLog::Pending> pending,
                            deletions_->FindPending());
  for (const auto& [deletion, map] : pending) {
    if (map == name) HYPERMAP_RETURN_IF_ERROR(deletions_->Cancel(deletion));
  }
  if (trash_.keeps_maps()) {
    HYPERMAP_RETURN_IF_ERROR(reserve_->Use(DiskReserve::Purpose::kDeletion, [&] {
      mutex_.AssertHeld();
      return trash_.Link(PathOf(name), name);
    }));
  }
  HYPERMAP_RETURN_IF_ERROR(ReplaceFile(path, PathOf(name)));
  // The witness is of the earlier map. If it stays, the opening tells that the file was replaced.
  map_lock.RemoveFile().IgnoreError();
  return absl::OkStatus();
}

absl::StatusOr<std::optional<std::string>> GeoPackageStore::FindDeletion(
    const std::string& request_id) {
  const MutexLock lock(&mutex_);
  return deletions_->Find(request_id);
}

}  // namespace

absl::StatusOr<std::unique_ptr<MapStore>> OpenGeoPackageStore(const std::string& data_dir,
                                                              const GeoPackageOptions& options) {
  HYPERMAP_RETURN_IF_ERROR(MakeFolder(data_dir));
  absl::StatusOr<FileLock> lock = FileLock::Acquire(absl::StrCat(data_dir, "/LOCK"));
  if (!lock.ok()) {
    return absl::Status(lock.status().code(), absl::StrCat("cannot use the data folder ", data_dir,
                                                           ": ", lock.status().message()));
  }
  const std::string catalog = absl::StrCat(data_dir, "/catalog.sqlite");
  absl::StatusOr<std::unique_ptr<DeletionLog>> deletions =
      DeletionLog::Open(catalog, options.busy_timeout);
  if (!deletions.ok()) {
    return absl::Status(deletions.status().code(),
                        absl::StrCat(catalog, ": ", deletions.status().message()));
  }
  auto store =
      std::make_unique<GeoPackageStore>(data_dir, options, *std::move(lock), *std::move(deletions));
  HYPERMAP_RETURN_IF_ERROR(store->Recover());
  return store;
}

}  // namespace hypermap::storage
