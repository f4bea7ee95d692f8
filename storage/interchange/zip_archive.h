// Zip archives in memory. The one place that knows libzip.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_ZIP_ARCHIVE_H_
#define HYPERMAP_STORAGE_INTERCHANGE_ZIP_ARCHIVE_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/interchange/imported_map.h"

struct zip;

namespace hypermap::storage {

// Reads members of an archive on demand. What all reads together inflate is bounded, whatever sizes
// the archive claims. One thread.
class ZipArchive {
 public:
  // `data` must outlive the archive. INVALID_ARGUMENT for what is no zip or has a member whose name
  // leads out of a folder; RESOURCE_EXHAUSTED.
  static absl::StatusOr<ZipArchive> Open(absl::string_view data, const ImportLimits& limits);

  bool Contains(const std::string& member) const;

  // INVALID_ARGUMENT naming the member when it is missing, encrypted or damaged;
  // RESOURCE_EXHAUSTED past max_unpacked_bytes.
  absl::StatusOr<std::string> Read(const std::string& member);

 private:
  struct Discard {
    void operator()(zip* archive) const;
  };

  ZipArchive(zip* archive, const ImportLimits& limits);

  std::unique_ptr<zip, Discard> archive_;
  int64_t max_unpacked_bytes_;
  int64_t unpacked_bytes_ = 0;
};

// A flat archive of `members`, deflated; the same members give the same bytes.
absl::StatusOr<std::string> MakeZip(const std::vector<NamedFile>& members);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_ZIP_ARCHIVE_H_
