#include "client_libs/cpp/security.h"

#include <cerrno>
#include <fstream>
#include <sstream>
#include <utility>

#include "absl/strings/ascii.h"

namespace hypermap::client {
namespace {

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::ostringstream data;
  // A directory can be opened, but reading it fails and sets errno.
  if (file.is_open()) data << file.rdbuf();
  if (errno != 0) return absl::ErrnoToStatus(errno, path);
  return data.str();
}

}  // namespace

absl::StatusOr<TlsOptions> ReadTlsFiles(const TlsFiles& files) {
  TlsOptions options;
  const std::pair<const std::string&, std::string&> fields[] = {
      {files.root_certificates, options.root_certificates},
      {files.certificate_chain, options.certificate_chain},
      {files.private_key, options.private_key},
  };
  for (const auto& [path, field] : fields) {
    if (path.empty()) continue;
    absl::StatusOr<std::string> data = ReadFile(path);
    if (!data.ok()) return data.status();
    field = *std::move(data);
  }
  return options;
}

TokenSource TokenFromFile(std::string path) {
  return [path = std::move(path)]() -> absl::StatusOr<std::string> {
    absl::StatusOr<std::string> data = ReadFile(path);
    if (data.ok()) absl::StripAsciiWhitespace(&*data);
    return data;
  };
}

}  // namespace hypermap::client
