#include "client_libs/cpp/security.h"

#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "base/tls/pem.h"
#include "base/tls/tls_file.h"

namespace hypermap::client {
namespace {

absl::Status Named(const char* what, const absl::Status& status) {
  if (status.ok()) return status;
  return absl::InvalidArgumentError(absl::StrCat(what, ": ", status.message()));
}

// The content of a file of certificates. INVALID_ARGUMENT if it contains none.
absl::StatusOr<std::string> ReadCertificates(const char* what, const std::string& path) {
  absl::StatusOr<std::string> pem = tls::ReadFile(path);
  if (!pem.ok()) return pem;
  HYPERMAP_RETURN_IF_ERROR(Named(what, tls::CheckCertificates(*pem)));
  return pem;
}

}  // namespace

absl::Status CheckTls(const TlsOptions& tls) {
  if (!tls.root_certificates.empty()) {
    HYPERMAP_RETURN_IF_ERROR(
        ReadCertificates("the roots to trust", tls.root_certificates).status());
  }
  if (tls.certificate_chain.empty() != tls.private_key.empty()) {
    return absl::InvalidArgumentError(
        "the client's certificate and its key go together: one of them is missing");
  }
  if (tls.certificate_chain.empty()) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(const std::string certificate,
                            ReadCertificates("the client's certificate", tls.certificate_chain));
  HYPERMAP_ASSIGN_OR_RETURN(const std::string key, tls::ReadFile(tls.private_key));
  return Named("the client's key", tls::CheckKey(key, certificate));
}

TokenSource TokenFromFile(std::string path) {
  return [path = std::move(path)]() -> absl::StatusOr<std::string> {
    absl::StatusOr<std::string> data = tls::ReadFile(path);
    if (data.ok()) absl::StripAsciiWhitespace(&*data);
    return data;
  };
}

}  // namespace hypermap::client
