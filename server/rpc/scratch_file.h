// Temporary files that live as long as a request.
#ifndef HYPERMAP_SERVER_RPC_SCRATCH_FILE_H_
#define HYPERMAP_SERVER_RPC_SCRATCH_FILE_H_

#include <fstream>
#include <string>

#include "absl/strings/string_view.h"

namespace hypermap::server {

// A random name for a new file in `folder`. The destructor removes the file, if there is one.
class ScratchFile {
 public:
  explicit ScratchFile(const std::string& folder);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  const std::string& path() const { return path_; }

  // Appends bytes, in small pieces between which it gives way. Returns whether all of them were
  // written. Keeps the file open.
  [[nodiscard]] bool Append(absl::string_view bytes);
  // Closes the file until it is appended to again.
  void Close() { appended_.close(); }

  // Removes the scratch files that a killed server has left in `folder`. REQUIRES: no other server
  // uses the folder.
  static void RemoveLeftOver(const std::string& folder);

 private:
  const std::string path_;
  std::ofstream appended_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_SCRATCH_FILE_H_
