#include "storage/postgres/file_copies.h"

#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/transfer/map_copy.h"

namespace hypermap::storage::postgres {
namespace {

// Bytes of columns of variable size, and a size for the rest of each row with its indexes.
constexpr char kBytes[] = R"sql(
SELECT ((SELECT coalesce(sum(octet_length(shape) + octet_length(label) + octet_length(classes)
      + octet_length(tags) + octet_length(attributes) + 400), 0)
    FROM hypermap.objects WHERE map = $1)
  + (SELECT coalesce(sum(octet_length(image) + 200), 0) FROM hypermap.tiles WHERE map = $1)
  + (SELECT coalesce(sum(coalesce(octet_length(detail), 0) + 120), 0)
    FROM hypermap.changes WHERE map = $1)
  + (SELECT coalesce(sum(octet_length(author) + 60), 0) FROM hypermap.revisions WHERE map = $1)
  + (SELECT coalesce(sum(octet_length(object_ids) + octet_length(digest) + 200), 0)
    FROM hypermap.receipts WHERE map = $1)
  + (SELECT coalesce(sum(octet_length(parameters) + 200), 0)
    FROM hypermap.layer_versions WHERE map = $1)
  + (SELECT 60 * count(*) FROM hypermap.layer_revisions WHERE map = $1)
  + (SELECT 65536 * count(*) FROM hypermap.lineages WHERE map = $1)
  + (SELECT 200 * count(*) FROM hypermap.frame_versions WHERE map = $1)
  + (SELECT 300 * count(*) FROM hypermap.time_marks WHERE map = $1)
  + (SELECT coalesce(sum(octet_length(body) + 300), 0)
    FROM hypermap.observations WHERE map = $1)
  + (SELECT coalesce(sum(octet_length(body) + 300), 0)
    FROM hypermap.operator_facts WHERE map = $1)
  + (SELECT coalesce(sum(octet_length(state) + 300), 0)
    FROM hypermap.fusion_checkpoints WHERE map = $1)
  + (SELECT coalesce(sum(octet_length(state) + 300), 0) FROM hypermap.fusion_bases WHERE map = $1)
  + (SELECT 200 * count(*) FROM hypermap.fusion_tracks WHERE map = $1)
  + (SELECT 200 * count(*) FROM hypermap.forgotten_sequences WHERE map = $1))::bigint
)sql";
// Of a file without rows.
constexpr int64_t kBytesOfEmptyFile = int64_t{2} << 20;
// The file in the folder with its log, and the backup that is made of it.
constexpr int64_t kCopies = 3;

// A folder beside a file, for a store that is used for a moment.
class ScratchFolder {
 public:
  // Whatever is left there by a process that died is removed.
  static absl::StatusOr<ScratchFolder> Make(const std::string& file) {
    const std::string path = absl::StrCat(file, ".store");
    std::error_code error;
    std::filesystem::remove_all(path, error);
    if (!error) std::filesystem::create_directory(path, error);
    if (error) return absl::UnavailableError(absl::StrCat(path, ": ", error.message()));
    return ScratchFolder(path);
  }
  ScratchFolder(ScratchFolder&& other) noexcept : path_(std::exchange(other.path_, "")) {}
  ScratchFolder& operator=(ScratchFolder&&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  const std::string& path() const { return path_; }

 private:
  explicit ScratchFolder(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

class FileBackup : public MapBackup {
 public:
  FileBackup(OpenFolder open_files, std::string map,
             std::function<absl::StatusOr<std::unique_ptr<ReadableMap>>()> pin)
      : open_files_(std::move(open_files)), map_(std::move(map)), pin_(std::move(pin)) {}

  absl::Status WriteTo(const std::string& path) override {
    const absl::Status status = Write(path);
    if (status.ok()) return status;
    return absl::Status(status.code(), absl::StrCat("map ", map_, ": ", status.message()));
  }

 private:
  absl::Status Write(const std::string& path) {
    std::error_code error;
    if (std::filesystem::exists(path, error)) {
      return absl::AlreadyExistsError(absl::StrCat(path, " exists"));
    }
    HYPERMAP_ASSIGN_OR_RETURN(const ScratchFolder folder, ScratchFolder::Make(path));
    HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<MapStore> store, open_files_(folder.path()));
    HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<StoredMap> copy, Copy(*store));
    return copy->BackupTo(path);
  }

  absl::StatusOr<std::unique_ptr<StoredMap>> Copy(MapStore& store) {
    HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<ReadableMap> pinned, pin_());
    HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<StoredMap> copy,
                              BeginCopy(*pinned, pinned->header(), store));
    HYPERMAP_RETURN_IF_ERROR(CopyMap(*pinned, *copy));
    HYPERMAP_RETURN_IF_ERROR(copy->FinishCopy());
    return copy;
  }

  const OpenFolder open_files_;
  const std::string map_;
  const std::function<absl::StatusOr<std::unique_ptr<ReadableMap>>()> pin_;
};

}  // namespace

std::unique_ptr<MapBackup> MakeFileBackup(
    OpenFolder open_files, std::string map,
    std::function<absl::StatusOr<std::unique_ptr<ReadableMap>>()> pin) {
  return std::make_unique<FileBackup>(std::move(open_files), std::move(map), std::move(pin));
}

absl::StatusOr<int64_t> BytesOfFileBackup(Connection& connection, int64_t map) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> bytes, connection.QueryInt64(kBytes, map));
  return kCopies * (kBytesOfEmptyFile + bytes.value_or(0));
}

absl::StatusOr<CheckReport> CheckFileOf(const OpenFolder& open_files, const std::string& path,
                                        const EvidenceCheck& evidence) {
  HYPERMAP_ASSIGN_OR_RETURN(const ScratchFolder folder, ScratchFolder::Make(path));
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<MapStore> store, open_files(folder.path()));
  return store->CheckFile(path, evidence);
}

absl::Status UseMapInFile(const OpenFolder& open_files, const std::string& path,
                          const std::string& name, const std::string& request_id,
                          absl::FunctionRef<absl::Status(StoredMap&)> use) {
  HYPERMAP_ASSIGN_OR_RETURN(const ScratchFolder folder, ScratchFolder::Make(path));
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<MapStore> store, open_files(folder.path()));
  // The store takes the file that it restores. The same call may have to be made again.
  const std::string taken = absl::StrCat(folder.path(), "/file");
  std::error_code error;
  std::filesystem::copy_file(path, taken, error);
  if (error) return absl::UnavailableError(absl::StrCat(path, ": ", error.message()));
  HYPERMAP_RETURN_IF_ERROR(store->Restore(taken, name, request_id));
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<StoredMap> map, store->Open(name));
  return use(*map);
}

}  // namespace hypermap::storage::postgres
