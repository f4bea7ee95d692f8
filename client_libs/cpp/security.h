// Authentication of server and client: TLS certificates and tokens.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_SECURITY_H_
#define HYPERMAP_CLIENT_LIBS_CPP_SECURITY_H_

#include <functional>
#include <string>

#include "absl/status/statusor.h"

namespace hypermap::client {

// Certificates and keys are PEM texts.
struct TlsOptions {
  // Certificate authorities that the server's certificate may be signed by. Empty: those that the
  // system trusts.
  std::string root_certificates;
  // The client's own certificate with its intermediates, and its key, for a server that requires
  // one (--tls_client_ca). Both or none.
  std::string certificate_chain;
  std::string private_key;
  // The name that the server's certificate must have. Empty: the host of the target.
  std::string server_name;
};

// Paths of files with the fields of TlsOptions. An empty path leaves its field empty.
struct TlsFiles {
  std::string root_certificates;
  std::string certificate_chain;
  std::string private_key;
};

// Errors name the file: NOT_FOUND, PERMISSION_DENIED and the like.
absl::StatusOr<TlsOptions> ReadTlsFiles(const TlsFiles& files);

// Returns the token to send with a call. It is called for each attempt of each call, from any
// thread, so that tokens can be renewed. If it fails, the call fails with UNAUTHENTICATED and the
// error's message.
using TokenSource = std::function<absl::StatusOr<std::string>()>;

// Reads the token from a file at each call, without leading and trailing whitespace.
TokenSource TokenFromFile(std::string path);

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_SECURITY_H_
