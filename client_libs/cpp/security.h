// Authentication of server and client: TLS certificates and tokens.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_SECURITY_H_
#define HYPERMAP_CLIENT_LIBS_CPP_SECURITY_H_

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace hypermap::client {

// Certificates and keys are paths of PEM files. The files are read again every few seconds, and new
// connections use renewed ones; those that are open go on. Replace a certificate and its key
// together, by renaming a link to their folder: a pair that does not match can't connect.
struct TlsOptions {
  // Certificate authorities that the server's certificate may be signed by. Empty: those that the
  // system trusts.
  std::string root_certificates = {};
  // The client's own certificate with its intermediates, and its key, not encrypted, by which a
  // server may identify the client (--tls_client_ca). Both or none.
  std::string certificate_chain = {};
  std::string private_key = {};
  // The name that the server's certificate must have. Empty: the host of the target.
  std::string server_name = {};
};

// OK if the files can be used now. Errors of reading name the file: NOT_FOUND, PERMISSION_DENIED
// and the like. INVALID_ARGUMENT if one has no certificate or key, or they do not belong
// together.
absl::Status CheckTls(const TlsOptions& tls);

// Returns the token to send with a call. It is called for each attempt of each call, from any
// thread, so that tokens can be renewed. If it fails, the call fails with UNAUTHENTICATED and the
// error's message.
using TokenSource = std::function<absl::StatusOr<std::string>()>;

// Reads the token from a file at each call, without leading and trailing whitespace.
TokenSource TokenFromFile(std::string path);

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_SECURITY_H_
