#include "client_libs/cpp/security.h"

#include <utility>

#include "absl/strings/ascii.h"
#include "base/status/status_macros.h"
#include "base/tls/tls_file.h"

namespace hypermap::client {
absl::StatusOr<TlsOptions> ReadTlsFiles(const TlsFiles& files) {
  TlsOptions options;
  const std::pair<const std::string&, std::string&> fields[] = {
      {files.root_certificates, options.root_certificates},
      {files.certificate_chain, options.certificate_chain},
      {files.private_key, options.private_key},
  };
  for (const auto& [path, field] : fields) {
    if (path.empty()) continue;
    HYPERMAP_ASSIGN_OR_RETURN(std::string data, tls::ReadFile(path));
    field = std::move(data);
  }
  return options;
}

TokenSource TokenFromFile(std::string path) {
  return [path = std::move(path)]() -> absl::StatusOr<std::string> {
    absl::StatusOr<std::string> data = tls::ReadFile(path);
    if (data.ok()) absl::StripAsciiWhitespace(&*data);
    return data;
  };
}

}  // namespace hypermap::client
