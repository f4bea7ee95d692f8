// Files that live as long as a request.
#ifndef HYPERMAP_SERVER_RPC_SCRATCH_FILE_H_
#define HYPERMAP_SERVER_RPC_SCRATCH_FILE_H_

#include <string>

namespace hypermap::server {

// The name of a file that does not exist yet; whatever is there at the end is removed.
class ScratchFile {
 public:
  explicit ScratchFile(const std::string& folder);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  const std::string& path() const { return path_; }

  // Removes what a server that was killed has left in `folder`. Only for the server that owns it.
  static void RemoveLeftOver(const std::string& folder);

 private:
  const std::string path_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_SCRATCH_FILE_H_
