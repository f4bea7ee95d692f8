// The files of an import while they arrive.
#ifndef HYPERMAP_SERVER_SERVICES_UPLOADED_FILES_H_
#define HYPERMAP_SERVER_SERVICES_UPLOADED_FILES_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/admission/budget.h"
#include "server/rpc/facilities.h"
#include "server/rpc/scratch_file.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::server {

// Keeps the pieces in scratch files, so that uploads that have stopped or wait for a worker take no
// memory. Files that are left are removed with this object.
class UploadedFiles {
 public:
  // `client` (CallTicket::client) is charged for the bytes on disk. `facilities` must outlive this.
  UploadedFiles(const Facilities& facilities, absl::string_view client);

  // Appends a piece of a file; the pieces of one file follow each other. INVALID_ARGUMENT for a
  // file name with folders or one that came before; RESOURCE_EXHAUSTED beyond --max_import_bytes,
  // FixedLimits::kMaxImportFiles or --max_scratch_bytes, or if the disk is full.
  absl::Status Append(const std::string& file_name, const std::string& piece);

  // Bytes of all files.
  int64_t bytes() const { return charge_.amount(); }

  // Reads all files into memory. UNAVAILABLE if one can't be read back.
  absl::StatusOr<std::vector<storage::NamedFile>> Read();

  // Removes all files from the disk, which may take long for large ones.
  void Remove();

 private:
  struct File {
    std::string name;
    std::unique_ptr<ScratchFile> scratch;
    int64_t size = 0;
  };

  absl::Status Open(const std::string& file_name);

  const Facilities& facilities_;
  admission::Budget::Charge charge_;
  std::vector<File> files_;  // pieces are appended to the last
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_UPLOADED_FILES_H_
