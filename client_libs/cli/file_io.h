// Reads files, and writes files atomically.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_FILE_IO_H_
#define HYPERMAP_CLIENT_LIBS_CLI_FILE_IO_H_

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::cli {

// Errors name the file: NOT_FOUND, PERMISSION_DENIED and the like.
absl::StatusOr<std::string> ReadFile(const std::string& path);

// Writes a file that appears under its name either complete or not at all: it is written in the
// same folder under a temporary name and then renamed. Used by one thread.
class OutputFile {
 public:
  static absl::StatusOr<std::unique_ptr<OutputFile>> Create(const std::string& path);
  // Deletes the temporary file unless it was committed.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  absl::Status Append(absl::string_view data);
  // Syncs the file to disk and renames it, replacing an existing file. Must be called at most once,
  // at the end.
  absl::Status Commit();

 private:
  OutputFile(std::string path, std::string temporary_path, int fd);

  std::string path_;
  std::string temporary_path_;
  int fd_;
};

absl::Status WriteFile(const std::string& path, absl::string_view data);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_FILE_IO_H_
