#include "base/tls/tls_file.h"

#include <cerrno>
#include <fstream>
#include <sstream>

#include "absl/status/status.h"

namespace hypermap::tls {

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::ostringstream data;
  // A directory can be opened, but reading it fails and sets errno.
  if (file.is_open()) data << file.rdbuf();
  if (errno != 0) return absl::ErrnoToStatus(errno, path);
  return data.str();
}

}  // namespace hypermap::tls
