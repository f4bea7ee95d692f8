#include "storage/sqlite/page_checksums.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "storage/sqlite/durable_file.h"

namespace hypermap::storage {
namespace {

constexpr char kVfsName[] = "hypermap_checksums";

// The header of a database (https://www.sqlite.org/fileformat2.html#the_database_header).
constexpr absl::string_view kMagic("SQLite format 3\0", 16);
constexpr int kHeaderBytes = 100;
constexpr int kPageSizeAt = 16;
constexpr int kReservedBytesAt = 20;
constexpr int kMinPageBytes = 512;
constexpr int kMaxPageBytes = 65536;

// The lock, in the memory that connections share, of the one that writes to the log
// (https://www.sqlite.org/walformat.html#locks).
constexpr int kLogWriterLock = 0;

// Requests to a file, by sqlite3_file_control. SQLite's own have small numbers.
constexpr int kSetVerification = 0x48504d01;  // bool*
constexpr int kAskForChecksums = 0x48504d02;  // bool*, set

// Of this thread.
thread_local FailedPages* collecting = nullptr;
thread_local int64_t last_failed_page = 0;
thread_local int last_folder_error = 0;

using Checksum = std::array<unsigned char, kPageChecksumBytes>;

uint32_t WordAt(const unsigned char* bytes) {
  return bytes[0] | bytes[1] << 8 | bytes[2] << 16 | static_cast<uint32_t>(bytes[3]) << 24;
}

void PutWord(uint32_t word, unsigned char* bytes) {
  for (int i = 0; i < 4; ++i) bytes[i] = static_cast<unsigned char>(word >> (8 * i));
}

// A Fletcher checksum of 64 bits over words of 32 bits, little-endian, as in SQLite's cksumvfs.
Checksum ChecksumOf(absl::Span<const unsigned char> content) {
  uint32_t s1 = 0;
  uint32_t s2 = 0;
  for (size_t i = 0; i < content.size(); i += 8) {
    s1 += WordAt(&content[i]) + s2;
    s2 += WordAt(&content[i + 4]) + s1;
  }
  Checksum checksum;
  PutWord(s1, checksum.data());
  PutWord(s2, checksum.data() + 4);
  return checksum;
}

// Makes the name of a file durable. Returns a code of SQLite.
int SyncFolderOf(const char* path) {
  const int folder = open(FolderOf(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  last_folder_error = folder >= 0 && fsync(folder) == 0 ? 0 : errno;
  if (folder >= 0) close(folder);
  if (last_folder_error == 0) return SQLITE_OK;
  return last_folder_error == ENOSPC ? SQLITE_FULL : SQLITE_IOERR_DIR_FSYNC;
}

// An open file. SQLite has allocated it; the file of the system has memory of its own, because its
// size depends on the VFS that is the default one when the file is opened.
struct ChecksumFile {
  sqlite3_file base;
  sqlite3_file* real;
  bool is_database;  // otherwise a journal, a log or a temporary file, which has no pages
  bool keeps;        // pages have checksums
  bool verifies;
  int page_bytes;  // 0 until the header is known
  // Of a new journal or log: its path, until its name is durable; otherwise null.
  const char* unsynced_path;
  const char* log_path;  // of a log; otherwise null
  // Of a log: what the system reads from it may not be on the disk. After a sync that failed, Linux
  // keeps what was written in memory and takes it for written
  // (https://wiki.postgresql.org/wiki/Fsync_Errors); SQLite recovers it as commits when the log is
  // opened again, and later syncs don't write it. Commits behind it would be lost with it.
  bool is_doubtful;
  bool holds_log;  // of a database: this connection holds kLogWriterLock

  static ChecksumFile* From(sqlite3_file* file) { return reinterpret_cast<ChecksumFile*>(file); }
  static sqlite3_file* Real(sqlite3_file* file) { return From(file)->real; }

  // Looks at what is read from or written to the beginning of a file.
  void Look(const void* data, int size, sqlite3_int64 offset) {
    if (!is_database || offset != 0 || size < kHeaderBytes) return;
    const auto* header = static_cast<const unsigned char*>(data);
    if (std::memcmp(header, kMagic.data(), kMagic.size()) != 0) return;
    const int bytes = header[kPageSizeAt] << 8 | header[kPageSizeAt + 1];
    page_bytes = bytes == 1 ? kMaxPageBytes : bytes;
    keeps = header[kReservedBytesAt] == kPageChecksumBytes;
  }

  bool IsPage(int size, sqlite3_int64 offset) const {
    if (!keeps || size < kMinPageBytes || offset % size != 0) return false;
    return page_bytes == 0 ? (size & (size - 1)) == 0 : size == page_bytes;
  }

  // Returns whether what was read is no page with a checksum, or has the right one.
  bool IsIntact(const void* data, int size, sqlite3_int64 offset) const {
    const auto* bytes = static_cast<const unsigned char*>(data);
    const absl::Span<const unsigned char> page(bytes, static_cast<size_t>(size));
    if (IsPage(size, offset)) return HasValidChecksum(page);
    if (!is_database || offset != 0 || size < kMinPageBytes) return true;
    // The first page: does it only claim that pages have no checksums?
    std::vector<unsigned char> other(page.begin(), page.end());
    other[kReservedBytesAt] = kPageChecksumBytes;
    return !HasValidChecksum(other);
  }

  // Writes the content of a log over itself, so that the next sync writes it to the disk. Nobody
  // may write to it meanwhile.
  int WriteLogAgain() {
    ChecksumFile* const database = From(sqlite3_database_file_object(log_path));
    if (database->holds_log) return WriteAgain();
    // A checkpoint does not hold it.
    constexpr int kFlags = SQLITE_SHM_EXCLUSIVE;
    int code = ShmLock(&database->base, kLogWriterLock, 1, SQLITE_SHM_LOCK | kFlags);
    if (code != SQLITE_OK) return code;
    code = WriteAgain();
    const int unlocked = ShmLock(&database->base, kLogWriterLock, 1, SQLITE_SHM_UNLOCK | kFlags);
    return code == SQLITE_OK ? unlocked : code;
  }
  int WriteAgain() const {
    sqlite3_int64 size = 0;
    int code = real->pMethods->xFileSize(real, &size);
    // SQLite writes no more than 128 KiB in one call.
    unsigned char piece[kMaxPageBytes];
    for (sqlite3_int64 at = 0; code == SQLITE_OK && at < size;) {
      const int count = static_cast<int>(std::min<sqlite3_int64>(size - at, kMaxPageBytes));
      code = real->pMethods->xRead(real, piece, count, at);
      if (code == SQLITE_OK) code = real->pMethods->xWrite(real, piece, count, at);
      at += count;
    }
    return code;
  }

  static int Close(sqlite3_file* file) {
    ChecksumFile* const self = From(file);
    const int code = self->real->pMethods->xClose(self->real);
    std::free(self->real);
    self->real = nullptr;
    return code;
  }
  static int Read(sqlite3_file* file, void* data, int size, sqlite3_int64 offset) {
    ChecksumFile* const self = From(file);
    const int code = self->real->pMethods->xRead(self->real, data, size, offset);
    // SQLite takes an EIO for damage of the file, but it may pass, such as that of a network's
    // disk.
    if (code == SQLITE_IOERR_CORRUPTFS) return SQLITE_IOERR_READ;
    if (code != SQLITE_OK) return code;
    self->Look(data, size, offset);
    if (!self->verifies || self->IsIntact(data, size, offset)) return SQLITE_OK;
    FailedPages::Add(offset / size + 1);
    return SQLITE_IOERR_DATA;
  }
  static int Write(sqlite3_file* file, const void* data, int size, sqlite3_int64 offset) {
    ChecksumFile* const self = From(file);
    self->Look(data, size, offset);
    if (!self->IsPage(size, offset)) {
      return self->real->pMethods->xWrite(self->real, data, size, offset);
    }
    // The page is SQLite's, and is not to be changed.
    alignas(8) unsigned char page[kMaxPageBytes];
    std::memcpy(page, data, size);
    SetPageChecksum({page, static_cast<size_t>(size)});
    return self->real->pMethods->xWrite(self->real, page, size, offset);
  }
  static int FileControl(sqlite3_file* file, int operation, void* argument) {
    ChecksumFile* const self = From(file);
    switch (operation) {
      case kSetVerification:
        self->verifies = *static_cast<const bool*>(argument);
        return SQLITE_OK;
      case kAskForChecksums:
        *static_cast<bool*>(argument) = self->keeps;
        return SQLITE_OK;
      default:
        return self->real->pMethods->xFileControl(self->real, operation, argument);
    }
  }

  // The rest is handed on.
  static int Truncate(sqlite3_file* file, sqlite3_int64 size) {
    return Real(file)->pMethods->xTruncate(Real(file), size);
  }
  static int Sync(sqlite3_file* file, int flags) {
    ChecksumFile* const self = From(file);
    int code = self->is_doubtful ? self->WriteLogAgain() : SQLITE_OK;
    if (code == SQLITE_OK) code = self->real->pMethods->xSync(self->real, flags);
    self->is_doubtful = self->log_path != nullptr && code != SQLITE_OK;
    if (code != SQLITE_OK || self->unsynced_path == nullptr) return code;
    // SQLite syncs the folder, too, but takes no notice if that fails. After a power loss there
    // might be no log, and with it none of the commits that it contains.
    const int synced = SyncFolderOf(self->unsynced_path);
    if (synced == SQLITE_OK) self->unsynced_path = nullptr;
    return synced;
  }
  static int FileSize(sqlite3_file* file, sqlite3_int64* size) {
    return Real(file)->pMethods->xFileSize(Real(file), size);
  }
  static int Lock(sqlite3_file* file, int level) {
    return Real(file)->pMethods->xLock(Real(file), level);
  }
  static int Unlock(sqlite3_file* file, int level) {
    return Real(file)->pMethods->xUnlock(Real(file), level);
  }
  static int CheckReservedLock(sqlite3_file* file, int* result) {
    return Real(file)->pMethods->xCheckReservedLock(Real(file), result);
  }
  static int SectorSize(sqlite3_file* file) {
    return Real(file)->pMethods->xSectorSize(Real(file));
  }
  static int DeviceCharacteristics(sqlite3_file* file) {
    return Real(file)->pMethods->xDeviceCharacteristics(Real(file));
  }
  static int ShmMap(sqlite3_file* file, int page, int page_size, int extend,
                    void volatile** memory) {
    return Real(file)->pMethods->xShmMap(Real(file), page, page_size, extend, memory);
  }
  static int ShmLock(sqlite3_file* file, int offset, int count, int flags) {
    const int code = Real(file)->pMethods->xShmLock(Real(file), offset, count, flags);
    if (code == SQLITE_OK && offset <= kLogWriterLock && offset + count > kLogWriterLock) {
      From(file)->holds_log = (flags & SQLITE_SHM_LOCK) != 0;
    }
    return code;
  }
  static void ShmBarrier(sqlite3_file* file) { Real(file)->pMethods->xShmBarrier(Real(file)); }
  static int ShmUnmap(sqlite3_file* file, int remove) {
    return Real(file)->pMethods->xShmUnmap(Real(file), remove);
  }
};

// Version 2 has no memory mapping: all reads are seen.
constexpr sqlite3_io_methods kChecksumMethods = {
    2,
    ChecksumFile::Close,
    ChecksumFile::Read,
    ChecksumFile::Write,
    ChecksumFile::Truncate,
    ChecksumFile::Sync,
    ChecksumFile::FileSize,
    ChecksumFile::Lock,
    ChecksumFile::Unlock,
    ChecksumFile::CheckReservedLock,
    ChecksumFile::FileControl,
    ChecksumFile::SectorSize,
    ChecksumFile::DeviceCharacteristics,
    ChecksumFile::ShmMap,
    ChecksumFile::ShmLock,
    ChecksumFile::ShmBarrier,
    ChecksumFile::ShmUnmap,
    nullptr,
    nullptr,
};

// The VFS below: the default one at the moment, which tests replace by one that fails.
sqlite3_vfs* Below() { return sqlite3_vfs_find(nullptr); }

int OpenFile(sqlite3_vfs* /*vfs*/, sqlite3_filename path, sqlite3_file* file, int flags,
             int* flags_out) {
  sqlite3_vfs* const below = Below();
  file->pMethods = nullptr;
  ChecksumFile* const opened = ChecksumFile::From(file);
  opened->real = static_cast<sqlite3_file*>(std::calloc(1, below->szOsFile));
  if (opened->real == nullptr) return SQLITE_NOMEM;
  const int code = below->xOpen(below, path, opened->real, flags, flags_out);
  if (code != SQLITE_OK) {
    // SQLite closes a file that was not opened if it has methods.
    if (opened->real->pMethods != nullptr) opened->real->pMethods->xClose(opened->real);
    std::free(opened->real);
    return code;
  }
  opened->is_database = (flags & SQLITE_OPEN_MAIN_DB) != 0;
  // Pages of a new file may be written before its header, when the cache is full.
  sqlite3_int64 size = 0;
  opened->keeps = opened->is_database &&
                  opened->real->pMethods->xFileSize(opened->real, &size) == SQLITE_OK && size == 0;
  opened->verifies = true;
  opened->page_bytes = 0;
  constexpr int kJournals = SQLITE_OPEN_WAL | SQLITE_OPEN_MAIN_JOURNAL | SQLITE_OPEN_SUPER_JOURNAL;
  const bool is_new_journal = (flags & kJournals) != 0 && (flags & SQLITE_OPEN_CREATE) != 0;
  opened->unsynced_path = is_new_journal ? path : nullptr;
  const bool is_log = (flags & SQLITE_OPEN_WAL) != 0;
  opened->log_path = is_log ? path : nullptr;
  opened->is_doubtful =
      is_log && (opened->real->pMethods->xFileSize(opened->real, &size) != SQLITE_OK || size > 0);
  opened->holds_log = false;
  opened->base.pMethods = &kChecksumMethods;
  return SQLITE_OK;
}

int DeleteFile(sqlite3_vfs* /*vfs*/, const char* path, int sync_folder) {
  return Below()->xDelete(Below(), path, sync_folder);
}

int AccessFile(sqlite3_vfs* /*vfs*/, const char* path, int flags, int* result) {
  return Below()->xAccess(Below(), path, flags, result);
}

int GetLastError(sqlite3_vfs* /*vfs*/, int size, char* text) {
  return Below()->xGetLastError(Below(), size, text);
}

const char* RegisterChecksumVfs() {
  // The functions that are not replaced are not about files, or do not look at the VFS.
  static sqlite3_vfs vfs = *Below();
  vfs.szOsFile = sizeof(ChecksumFile);
  vfs.pNext = nullptr;
  vfs.zName = kVfsName;
  vfs.xOpen = OpenFile;
  vfs.xDelete = DeleteFile;
  vfs.xAccess = AccessFile;
  vfs.xGetLastError = GetLastError;
  return sqlite3_vfs_register(&vfs, /*makeDflt=*/0) == SQLITE_OK ? kVfsName : nullptr;
}

absl::Status AsStatus(int code, absl::string_view doing) {
  if (code == SQLITE_OK) return absl::OkStatus();
  const std::string message = absl::StrCat(doing, ": ", sqlite3_errstr(code));
  return (code & 0xff) == SQLITE_FULL ? absl::ResourceExhaustedError(message)
                                      : absl::UnavailableError(message);
}

sqlite3_file* FileOf(sqlite3* database) {
  sqlite3_file* file = nullptr;
  sqlite3_file_control(database, "main", SQLITE_FCNTL_FILE_POINTER, &file);
  return file;
}

}  // namespace

const char* ChecksumVfs() {
  static const char* const name = RegisterChecksumVfs();
  return name;
}

void SetPageChecksum(absl::Span<unsigned char> page) {
  const Checksum checksum = ChecksumOf(page.first(page.size() - kPageChecksumBytes));
  std::copy(checksum.begin(), checksum.end(), page.end() - kPageChecksumBytes);
}

bool HasValidChecksum(absl::Span<const unsigned char> page) {
  const Checksum checksum = ChecksumOf(page.first(page.size() - kPageChecksumBytes));
  return std::equal(checksum.begin(), checksum.end(), page.end() - kPageChecksumBytes);
}

void KeepChecksums(sqlite3* database) {
  int bytes = kPageChecksumBytes;
  sqlite3_file_control(database, "main", SQLITE_FCNTL_RESERVE_BYTES, &bytes);
}

bool KeepsChecksums(sqlite3* database) {
  bool keeps = false;
  sqlite3_file_control(database, "main", kAskForChecksums, &keeps);
  return keeps;
}

UnverifiedReads::UnverifiedReads(sqlite3* database) : database_(database) {
  bool verifies = false;
  sqlite3_file_control(database_, "main", kSetVerification, &verifies);
}

UnverifiedReads::~UnverifiedReads() {
  bool verifies = true;
  sqlite3_file_control(database_, "main", kSetVerification, &verifies);
}

absl::StatusOr<int64_t> AdoptPages(sqlite3* database) {
  ChecksumFile* const checked = ChecksumFile::From(FileOf(database));
  sqlite3_file* const file = checked->real;
  const int size = checked->page_bytes;
  if (!checked->keeps || size < kMinPageBytes) return 0;
  sqlite3_int64 file_bytes = 0;
  absl::Status status = AsStatus(file->pMethods->xFileSize(file, &file_bytes), "size");
  const auto buffer = std::make_unique<unsigned char[]>(size);
  const absl::Span<unsigned char> page(buffer.get(), size);
  int64_t num_adopted = 0;
  for (int64_t at = 0; status.ok() && at + size <= file_bytes; at += size) {
    status = AsStatus(file->pMethods->xRead(file, page.data(), size, at), "reading a page");
    if (!status.ok() || HasValidChecksum(page)) continue;
    SetPageChecksum(page);
    // A write that is torn tears nothing but the checksum.
    status = AsStatus(file->pMethods->xWrite(file, page.data(), size, at), "writing a page");
    ++num_adopted;
  }
  if (status.ok() && num_adopted > 0) {
    status = AsStatus(file->pMethods->xSync(file, SQLITE_SYNC_FULL), "syncing");
  }
  if (!status.ok()) return status;
  return num_adopted;
}

FailedPages::FailedPages() : outer_(collecting) { collecting = this; }

FailedPages::~FailedPages() { collecting = outer_; }

void FailedPages::Add(int64_t number) {
  last_failed_page = number;
  for (FailedPages* pages = collecting; pages != nullptr; pages = pages->outer_) {
    pages->numbers_.insert(number);
  }
}

int64_t LastFailedPage() { return last_failed_page; }

int LastFolderError() { return last_folder_error; }

std::string DescribeFailedPage(int64_t number) {
  return absl::StrCat("page ", number,
                      " of the file is damaged: its content does not have its checksum");
}

}  // namespace hypermap::storage
