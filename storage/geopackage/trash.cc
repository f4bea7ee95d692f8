#include "storage/geopackage/trash.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/map_file.h"
#include "storage/sqlite/durable_file.h"

namespace hypermap::storage {
namespace {

absl::Status RemoveForGood(const std::string& path) {
  std::error_code error;
  std::filesystem::remove_all(path, error);
  // A map that was removed does not come back after a power loss.
  if (!error) return SyncFolder(FolderOf(path));
  return absl::UnavailableError(absl::StrCat("cannot remove ", path, ": ", error.message()));
}

std::string NameOf(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

// `path`, a dot and a number, of which nothing has the name.
absl::StatusOr<std::string> FreeName(const std::string& path) {
  for (int number = 1;; ++number) {
    std::string name = absl::StrCat(path, ".", number);
    HYPERMAP_ASSIGN_OR_RETURN(const bool exists, FindPath(name));
    if (!exists) return name;
  }
}

// A folder that has the number of this deletion may be of an older one, whose record was lost with
// catalog.sqlite. It gets another name, so that its map is not overwritten.
absl::Status SetEarlierAside(const std::string& entry) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string aside, FreeName(entry));
  return MoveFile(entry, aside);
}

}  // namespace

Trash::Trash(std::string folder, absl::Duration age) : folder_(std::move(folder)), age_(age) {}

absl::Status Trash::Take(const std::string& path, const std::string& map, int64_t deletion) {
  const std::string entry = absl::StrCat(folder_, "/", map, ".", deletion);
  const std::string moved = absl::StrCat(entry, "/", NameOf(path));
  // The map's file is moved once, so that one that is there already is another's.
  if (PathExists(path) && PathExists(moved)) HYPERMAP_RETURN_IF_ERROR(SetEarlierAside(entry));
  HYPERMAP_RETURN_IF_ERROR(MakeEntry(entry));
  HYPERMAP_RETURN_IF_ERROR(MoveFile(path, moved));
  HYPERMAP_RETURN_IF_ERROR(MoveFile(LogPathOf(path), LogPathOf(moved)));
  HYPERMAP_RETURN_IF_ERROR(MoveFile(OrphanPathOf(path), OrphanPathOf(moved)));
  HYPERMAP_RETURN_IF_ERROR(RemoveSidecars(path));
  HYPERMAP_RETURN_IF_ERROR(SyncFolder(entry));
  HYPERMAP_RETURN_IF_ERROR(SyncFolder(FolderOf(path)));
  // A deletion that is repeated may find nothing to move. A folder with files stays.
  std::error_code error;
  std::filesystem::remove(entry, error);
  return absl::OkStatus();
}

absl::Status Trash::MakeEntry(const std::string& entry) const {
  HYPERMAP_RETURN_IF_ERROR(MakeFolder(entry));
  HYPERMAP_RETURN_IF_ERROR(SyncFolder(folder_));
  return SyncFolder(FolderOf(folder_));
}

absl::Status Trash::Link(const std::string& path, const std::string& map) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string entry, FreeName(absl::StrCat(folder_, "/", map)));
  HYPERMAP_RETURN_IF_ERROR(MakeEntry(entry));
  return LinkOrCopyFile(path, absl::StrCat(entry, "/", NameOf(path)));
}

absl::Status Trash::RemoveLinksTo(const std::string& data_dir) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Entry> entries, FindEntries());
  for (const Entry& entry : entries) {
    const std::string map = std::filesystem::path(entry.path).stem().string();
    std::error_code error;
    const bool is_there =
        std::filesystem::equivalent(absl::StrCat(entry.path, "/", map, ".gpkg"),
                                    absl::StrCat(data_dir, "/", map, ".gpkg"), error);
    if (is_there && !error) HYPERMAP_RETURN_IF_ERROR(RemoveForGood(entry.path));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<Trash::Entry>> Trash::FindEntries() const {
  std::vector<Entry> entries;
  if (!PathExists(folder_)) return entries;
  std::error_code error;
  std::filesystem::directory_iterator entry(folder_, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const std::string path = entry->path().string();
    struct stat status;
    if (lstat(path.c_str(), &status) != 0) return FileError(errno, path);
    if (!S_ISDIR(status.st_mode)) continue;
    entries.push_back({absl::TimeFromTimespec(status.st_mtim), path});
  }
  if (error) return absl::UnavailableError(absl::StrCat(folder_, ": ", error.message()));
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::pair(a.since, a.path) < std::pair(b.since, b.path);
  });
  return entries;
}

absl::Status Trash::RemoveOld(absl::Time now) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Entry> entries, FindEntries());
  for (const Entry& entry : entries) {
    if (now - entry.since >= age_) HYPERMAP_RETURN_IF_ERROR(RemoveForGood(entry.path));
  }
  return absl::OkStatus();
}

absl::Status Trash::RemoveOldest() {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Entry> entries, FindEntries());
  if (entries.empty()) return absl::NotFoundError(absl::StrCat(folder_, " is empty"));
  return RemoveForGood(entries.front().path);
}

}  // namespace hypermap::storage
