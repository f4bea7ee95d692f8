// What hypermapd shows of itself to clients, and which clients it lets in.
#ifndef HYPERMAP_BASE_TLS_SERVER_CREDENTIALS_H_
#define HYPERMAP_BASE_TLS_SERVER_CREDENTIALS_H_

#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace hypermap::server {

// Paths of PEM files. All empty: no TLS.
struct TlsFiles {
  // --tls_cert: the server's certificate, then those that lead to its root.
  std::string certificate;
  // --tls_key: of that certificate; not encrypted.
  std::string key;
  // --tls_client_ca: who signs the certificates of clients, which each client then must have.
  // Empty: clients are not asked for one.
  std::string client_ca;
};

// INVALID_ARGUMENT naming the flag that is missing, or whose file can't be read, is not what it
// should be, or does not fit the other.
absl::Status CheckTlsFiles(const TlsFiles& files);

// After CheckTlsFiles. The files are read again every few seconds: a renewed certificate is shown
// to the clients that connect from then on, an unfit one is not taken.
std::shared_ptr<grpc::ServerCredentials> MakeServerCredentials(const TlsFiles& files);

}  // namespace hypermap::server

#endif  // HYPERMAP_BASE_TLS_SERVER_CREDENTIALS_H_
