#include "storage/geopackage/testing/faulty_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "absl/strings/match.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {

// An open file. The file of the real VFS follows it in the memory that SQLite has allocated.
struct FaultyFile {
  sqlite3_file base;
  FaultyFiles* files;
  std::string* name;
  int id;           // -1: not recorded
  bool syncs_name;  // SQLite syncs the folder when it first syncs a new journal

  static FaultyFile* From(sqlite3_file* file) { return reinterpret_cast<FaultyFile*>(file); }
  static sqlite3_file* Real(sqlite3_file* file) {
    return reinterpret_cast<sqlite3_file*>(reinterpret_cast<char*>(file) + sizeof(FaultyFile));
  }
  bool Fails(FileCall call) const { return files->Fails(call, *name); }
  int code() const { return files->fault_.code; }
  void Record(FileEvent event) const {
    if (id < 0) return;
    event.file = id;
    files->Record(std::move(event));
  }

  static int Close(sqlite3_file* file) {
    const int code = Real(file)->pMethods->xClose(Real(file));
    delete From(file)->name;
    From(file)->name = nullptr;
    return code;
  }
  static int Read(sqlite3_file* file, void* data, int size, sqlite3_int64 offset) {
    if (From(file)->Fails(FileCall::kRead)) return From(file)->code();
    return Real(file)->pMethods->xRead(Real(file), data, size, offset);
  }
  static int Write(sqlite3_file* file, const void* data, int size, sqlite3_int64 offset) {
    FaultyFile* self = From(file);
    const bool fails = self->Fails(FileCall::kWrite);
    if (fails && !self->files->fault_.writes_half) return self->code();
    if (fails) size /= 2;
    FileEvent event{FileEvent::Kind::kWrite};
    event.offset = offset;
    event.bytes.assign(static_cast<const char*>(data), size);
    self->Record(std::move(event));
    const int code = Real(file)->pMethods->xWrite(Real(file), data, size, offset);
    return fails ? self->code() : code;
  }
  static int Truncate(sqlite3_file* file, sqlite3_int64 size) {
    FaultyFile* self = From(file);
    if (self->Fails(FileCall::kTruncate)) return self->code();
    FileEvent event{FileEvent::Kind::kTruncate};
    event.offset = size;
    self->Record(std::move(event));
    return Real(file)->pMethods->xTruncate(Real(file), size);
  }
  static int Sync(sqlite3_file* file, int /*flags*/) {
    FaultyFile* self = From(file);
    if (self->Fails(FileCall::kSync)) {
      self->Record({FileEvent::Kind::kSyncFailed});
      return self->code();
    }
    self->Record({FileEvent::Kind::kSync});
    if (self->syncs_name) self->Record({FileEvent::Kind::kSyncFolder});
    self->syncs_name = false;
    return SQLITE_OK;
  }
  static int FileSize(sqlite3_file* file, sqlite3_int64* size) {
    if (From(file)->Fails(FileCall::kSize)) return From(file)->code();
    return Real(file)->pMethods->xFileSize(Real(file), size);
  }
  static int Lock(sqlite3_file* file, int level) {
    if (From(file)->Fails(FileCall::kLock)) return From(file)->code();
    return Real(file)->pMethods->xLock(Real(file), level);
  }
  static int Unlock(sqlite3_file* file, int level) {
    return Real(file)->pMethods->xUnlock(Real(file), level);
  }
  static int CheckReservedLock(sqlite3_file* file, int* result) {
    return Real(file)->pMethods->xCheckReservedLock(Real(file), result);
  }
  static int FileControl(sqlite3_file* file, int operation, void* argument) {
    return Real(file)->pMethods->xFileControl(Real(file), operation, argument);
  }
  static int SectorSize(sqlite3_file* file) {
    return Real(file)->pMethods->xSectorSize(Real(file));
  }
  static int DeviceCharacteristics(sqlite3_file* file) {
    return Real(file)->pMethods->xDeviceCharacteristics(Real(file));
  }
  static int ShmMap(sqlite3_file* file, int page, int page_size, int extend,
                    void volatile** memory) {
    if (From(file)->Fails(FileCall::kShm)) return From(file)->code();
    return Real(file)->pMethods->xShmMap(Real(file), page, page_size, extend, memory);
  }
  static int ShmLock(sqlite3_file* file, int offset, int count, int flags) {
    const bool takes = (flags & SQLITE_SHM_LOCK) != 0;
    if (takes && From(file)->Fails(FileCall::kShm)) return From(file)->code();
    return Real(file)->pMethods->xShmLock(Real(file), offset, count, flags);
  }
  static void ShmBarrier(sqlite3_file* file) { Real(file)->pMethods->xShmBarrier(Real(file)); }
  static int ShmUnmap(sqlite3_file* file, int remove) {
    return Real(file)->pMethods->xShmUnmap(Real(file), remove);
  }
};

namespace {

// Version 2 has no memory mapping, so that all reads and writes are seen.
constexpr sqlite3_io_methods kMethods = {
    2,
    FaultyFile::Close,
    FaultyFile::Read,
    FaultyFile::Write,
    FaultyFile::Truncate,
    FaultyFile::Sync,
    FaultyFile::FileSize,
    FaultyFile::Lock,
    FaultyFile::Unlock,
    FaultyFile::CheckReservedLock,
    FaultyFile::FileControl,
    FaultyFile::SectorSize,
    FaultyFile::DeviceCharacteristics,
    FaultyFile::ShmMap,
    FaultyFile::ShmLock,
    FaultyFile::ShmBarrier,
    FaultyFile::ShmUnmap,
    nullptr,
    nullptr,
};

std::optional<ino_t> InodeOf(const std::string& path) {
  struct stat status;
  if (lstat(path.c_str(), &status) != 0) return std::nullopt;
  return status.st_ino;
}

// Returns at most the first 256 bytes, which is enough for a short file and quick at each event.
std::string ReadBeginning(const std::string& path) {
  std::string bytes(256, '\0');
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const ssize_t size = file < 0 ? 0 : read(file, bytes.data(), bytes.size());
  if (file >= 0) close(file);
  bytes.resize(std::max<ssize_t>(size, 0));
  return bytes;
}

bool IsJournal(int flags) {
  return (flags & (SQLITE_OPEN_WAL | SQLITE_OPEN_MAIN_JOURNAL | SQLITE_OPEN_SUPER_JOURNAL)) != 0;
}

}  // namespace

FaultyFiles::FaultyFiles(std::string folder, std::string witness_name)
    : folder_(std::move(folder) + "/"),
      witness_name_(std::move(witness_name)),
      real_(sqlite3_vfs_find(nullptr)),
      vfs_(*real_) {
  fault_.count = 0;
  vfs_.szOsFile = static_cast<int>(sizeof(FaultyFile)) + real_->szOsFile;
  vfs_.pNext = nullptr;
  vfs_.zName = "hypermap_faulty";
  vfs_.pAppData = this;
  vfs_.xOpen = Open;
  vfs_.xDelete = Delete;
  vfs_.xAccess = Access;
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    const std::string name = entry.path().filename();
    const bool is_ours = absl::EndsWith(name, ".gpkg") || absl::EndsWith(name, "-wal") ||
                         absl::EndsWith(name, "-journal") || absl::EndsWith(name, ".sqlite");
    if (is_ours) Identify(name, /*is_new=*/false);
  }
  sqlite3_vfs_register(&vfs_, 1);
}

FaultyFiles::~FaultyFiles() {
  sqlite3_vfs_unregister(&vfs_);
  sqlite3_vfs_register(real_, 1);
}

void FaultyFiles::Count(std::function<bool(absl::string_view)> files) {
  FileFault none;
  none.count = 0;
  Arm(std::move(files), none);
}

void FaultyFiles::Arm(std::function<bool(absl::string_view)> files, const FileFault& fault) {
  counted_ = std::move(files);
  fault_ = fault;
  failed_ = 0;
  calls_.fill(0);
}

bool FaultyFiles::Fails(FileCall call, const std::string& name) {
  if (name.empty() || counted_ == nullptr || !counted_(name)) return false;
  const int number = ++calls_[static_cast<int>(call)];
  const bool fails =
      call == fault_.call && number >= fault_.first && number - fault_.first < fault_.count;
  if (fails) ++failed_;
  return fails;
}

std::string FaultyFiles::NameOf(const char* path) const {
  absl::string_view name = path == nullptr ? "" : path;
  if (!absl::StartsWith(name, folder_)) return "";
  return std::string(name.substr(folder_.size()));
}

void FaultyFiles::Note(int64_t number) {
  FindChangedNames();
  FileEvent event;
  event.offset = number;
  Record(std::move(event));
}

void FaultyFiles::Record(FileEvent event) {
  if (!witness_name_.empty()) event.witness = ReadBeginning(folder_ + witness_name_);
  events_.push_back(std::move(event));
}

void FaultyFiles::FindChangedNames() {
  std::vector<std::pair<std::string, NamedFile>> gone;
  for (const auto& [name, file] : names_) {
    const std::optional<ino_t> inode = InodeOf(folder_ + name);
    if (!inode || *inode != file.inode) gone.emplace_back(name, file);
  }
  for (const auto& [name, file] : gone) {
    names_.erase(name);
    FileEvent event{FileEvent::Kind::kVanish};
    event.name = name;
    Record(event);
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
      const std::string other = entry.path().filename();
      if (names_.contains(other) || InodeOf(entry.path()) != file.inode) continue;
      names_[other] = file;
      event.kind = FileEvent::Kind::kRename;
      event.file = file.id;
      event.name = other;
      Record(event);
      break;
    }
  }
}

int FaultyFiles::Identify(const std::string& name, bool is_new) {
  const auto known = names_.find(name);
  if (known != names_.end() && !is_new) return known->second.id;
  names_[name] = {num_files_, InodeOf(folder_ + name).value_or(0)};
  FileEvent event{is_new ? FileEvent::Kind::kCreate : FileEvent::Kind::kAppear};
  event.file = num_files_;
  event.name = name;
  if (!is_new) event.bytes = ReadFile(folder_ + name);
  Record(std::move(event));
  return num_files_++;
}

int FaultyFiles::Open(sqlite3_vfs* vfs, const char* path, sqlite3_file* file, int flags,
                      int* flags_out) {
  FaultyFiles* self = Of(vfs);
  self->FindChangedNames();
  file->pMethods = nullptr;
  const std::string name = self->NameOf(path);
  if (self->Fails(FileCall::kOpen, name)) return self->fault_.code;
  const bool is_new = path == nullptr || !InodeOf(path);
  const int code = self->real_->xOpen(self->real_, path, FaultyFile::Real(file), flags, flags_out);
  if (code != SQLITE_OK) return code;
  FaultyFile* opened = FaultyFile::From(file);
  opened->base.pMethods = &kMethods;
  opened->files = self;
  opened->name = new std::string(name);
  opened->id = name.empty() ? -1 : self->Identify(name, is_new);
  opened->syncs_name = IsJournal(flags) && (flags & SQLITE_OPEN_CREATE) != 0;
  return SQLITE_OK;
}

int FaultyFiles::Delete(sqlite3_vfs* vfs, const char* path, int sync_folder) {
  FaultyFiles* self = Of(vfs);
  self->FindChangedNames();
  const std::string name = self->NameOf(path);
  if (self->Fails(FileCall::kDelete, name)) return self->fault_.code;
  const int code = self->real_->xDelete(self->real_, path, 0);
  if (code != SQLITE_OK || name.empty()) return code;
  self->names_.erase(name);
  FileEvent event{FileEvent::Kind::kRemove};
  event.name = name;
  self->Record(std::move(event));
  if (sync_folder != 0) self->Record({FileEvent::Kind::kSyncFolder});
  return SQLITE_OK;
}

int FaultyFiles::Access(sqlite3_vfs* vfs, const char* path, int flags, int* result) {
  FaultyFiles* self = Of(vfs);
  if (self->Fails(FileCall::kAccess, self->NameOf(path))) return self->fault_.code;
  return self->real_->xAccess(self->real_, path, flags, result);
}

}  // namespace hypermap::storage
