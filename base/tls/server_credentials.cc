#include "base/tls/server_credentials.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "base/tls/pem.h"
#include "base/tls/tls_file.h"

namespace hypermap::tls {
namespace {

absl::Status Named(const char* flag, const std::string& path, const absl::Status& status) {
  if (status.ok()) return status;
  return absl::InvalidArgumentError(absl::StrCat(flag, "=", path, ": ", status.message()));
}

absl::StatusOr<std::string> ReadFileOf(const char* flag, const std::string& path) {
  absl::StatusOr<std::string> data = ReadFile(path);
  if (data.ok()) return data;
  return absl::InvalidArgumentError(absl::StrCat(flag, "=", data.status().message()));
}

// The content of a file of certificates. INVALID_ARGUMENT if it contains none.
absl::StatusOr<std::string> ReadCertificates(const char* flag, const std::string& path) {
  absl::StatusOr<std::string> pem = ReadFileOf(flag, path);
  if (!pem.ok()) return pem;
  HYPERMAP_RETURN_IF_ERROR(Named(flag, path, CheckCertificates(*pem)));
  return pem;
}

}  // namespace

absl::Status CheckServerFiles(const ServerFiles& files) {
  if (files.certificate.empty() != files.key.empty()) {
    return absl::InvalidArgumentError("--tls_cert and --tls_key go together: one is missing");
  }
  if (files.certificate.empty()) {
    if (files.client_ca.empty()) return absl::OkStatus();
    return absl::InvalidArgumentError("--tls_client_ca needs --tls_cert and --tls_key");
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::string certificate,
                            ReadCertificates("--tls_cert", files.certificate));
  HYPERMAP_ASSIGN_OR_RETURN(const std::string key, ReadFileOf("--tls_key", files.key));
  absl::Status status = Named("--tls_key", files.key, CheckKey(key, certificate));
  return status.ok() ? CheckAuthorities("--tls_client_ca", files.client_ca) : status;
}

absl::Status CheckAuthorities(const char* flag, const std::string& path) {
  return path.empty() ? absl::OkStatus() : ReadCertificates(flag, path).status();
}

std::shared_ptr<grpc::ServerCredentials> MakeServerCredentials(const ServerFiles& files) {
  if (files.certificate.empty()) return grpc::InsecureServerCredentials();
  grpc::experimental::TlsServerCredentialsOptions options(
      std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(
          files.key, files.certificate, files.client_ca, kReadAgainSeconds));
  options.watch_identity_key_cert_pairs();
  if (!files.client_ca.empty()) {
    options.watch_root_certs();
    options.set_cert_request_type(files.need_client_certificates
                                      ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                                      : GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return grpc::experimental::TlsServerCredentials(options);
}

}  // namespace hypermap::tls
