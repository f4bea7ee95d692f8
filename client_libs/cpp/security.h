// How a client knows the server, and the server the client.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_SECURITY_H_
#define HYPERMAP_CLIENT_LIBS_CPP_SECURITY_H_

#include <functional>
#include <string>

#include "absl/status/statusor.h"

namespace hypermap::client {

// Certificates and keys are PEM texts.
struct TlsOptions {
  // Who may have signed the server's certificate. Empty: those whom the system trusts.
  std::string root_certificates;
  // The client's own certificate, with those that lead to its root, and its key, for a server that
  // asks for one (--tls_client_ca). Both or none.
  std::string certificate_chain;
  std::string private_key;
  // The name that the server's certificate must have. Empty: the host of the target.
  std::string server_name;
};

// Where TlsOptions lie; an empty path leaves its field empty.
struct TlsFiles {
  std::string root_certificates;
  std::string certificate_chain;
  std::string private_key;
};

// NOT_FOUND, PERMISSION_DENIED and the like, naming the file.
absl::StatusOr<TlsOptions> ReadTlsFiles(const TlsFiles& files);

// The token to send with a call. Asked for each try of each call, from any thread, so that a token
// can be renewed. Without one the call fails with UNAUTHENTICATED and the error's message.
using TokenSource = std::function<absl::StatusOr<std::string>()>;

// The content of a file as it is at each call, without the blanks around it.
TokenSource TokenFromFile(std::string path);

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_SECURITY_H_
