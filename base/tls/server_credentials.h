// The server's TLS credentials: its certificate, and the check of client certificates.
#ifndef HYPERMAP_BASE_TLS_SERVER_CREDENTIALS_H_
#define HYPERMAP_BASE_TLS_SERVER_CREDENTIALS_H_

#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace hypermap::tls {

// Paths of PEM files. All empty: no TLS.
struct ServerFiles {
  // --tls_cert: the server's certificate, followed by the chain that leads to its root.
  std::string certificate;
  // --tls_key: the key of that certificate, not encrypted.
  std::string key;
  // --tls_client_ca: the authorities that sign client certificates. Empty: clients are not asked
  // for one.
  std::string client_ca;
  // --tls_client_certificates: whether all clients must have a certificate then, and not only may.
  bool need_client_certificates = true;
};

// INVALID_ARGUMENT naming the flag that is missing, or whose file can't be read, has no certificate
// or key, or does not match the other file.
absl::Status CheckServerFiles(const ServerFiles& files);

// INVALID_ARGUMENT naming the flag if its file of certificates can't be read or has none. OK for an
// empty path.
absl::Status CheckAuthorities(const char* flag, const std::string& path);

// Reads the files again every few seconds. New connections use a renewed certificate; an invalid
// one is ignored. REQUIRES: CheckServerFiles(files) is OK.
std::shared_ptr<grpc::ServerCredentials> MakeServerCredentials(const ServerFiles& files);

}  // namespace hypermap::tls

#endif  // HYPERMAP_BASE_TLS_SERVER_CREDENTIALS_H_
