// Zip archives in memory. Only this file and its source use libzip.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_ZIP_ARCHIVE_H_
#define HYPERMAP_STORAGE_INTERCHANGE_ZIP_ARCHIVE_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/limits/limits.h"
#include "storage/interchange/imported_map.h"

struct zip;

namespace hypermap::storage {

// Reads members of an archive on demand. The bytes that all reads together inflate are limited,
// whatever sizes the archive claims. Not thread safe.
class ZipArchive {
 public:
  // `data` must outlive the archive. INVALID_ARGUMENT when it is not a zip archive or has a member
  // whose name leads out of a folder; RESOURCE_EXHAUSTED when it has too many members.
  static absl::StatusOr<ZipArchive> Open(absl::string_view data, const Limits& limits);

  bool Contains(const std::string& member) const;

  // INVALID_ARGUMENT naming the member when it is missing, encrypted or damaged;
  // RESOURCE_EXHAUSTED when more than max_unpacked_bytes have been inflated.
  absl::StatusOr<std::string> Read(const std::string& member);

 private:
  struct Discard {
    void operator()(zip* archive) const;
  };

  ZipArchive(zip* archive, const Limits& limits);

  std::unique_ptr<zip, Discard> archive_;
  int64_t max_unpacked_bytes_;
  int64_t unpacked_bytes_ = 0;
};

// Makes a flat archive of deflated members. Equal members give equal bytes. Takes memory for the
// packed members and for the archive; errors of TakeMemory and CheckCancelled.
absl::StatusOr<std::string> MakeZip(const std::vector<NamedFile>& members);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_ZIP_ARCHIVE_H_
