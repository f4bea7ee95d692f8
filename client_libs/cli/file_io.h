// Whole files in, complete files out.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_FILE_IO_H_
#define HYPERMAP_CLIENT_LIBS_CLI_FILE_IO_H_

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::cli {

// NOT_FOUND, PERMISSION_DENIED and the like, naming the file.
absl::StatusOr<std::string> ReadFile(const std::string& path);

// A file that appears under its name complete or not at all: written beside it under another name,
// and renamed. One thread.
class OutputFile {
 public:
  static absl::StatusOr<std::unique_ptr<OutputFile>> Create(const std::string& path);
  // Removes what was written when it was not committed.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  absl::Status Append(absl::string_view data);
  // Puts the file on disk under its name, in place of one that may be there. Once, at the end.
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
