// Flags that name servers and the security of the connection to them.
#ifndef HYPERMAP_CLIENT_LIBS_FLAGS_CONNECTION_FLAGS_H_
#define HYPERMAP_CLIENT_LIBS_FLAGS_CONNECTION_FLAGS_H_

#include <CLI/CLI.hpp>
#include <string>

#include "absl/status/statusor.h"
#include "client_libs/cpp/client.h"

namespace hypermap::client {

// The values of the flags.
struct ConnectionFlags {
  std::string server = "127.0.0.1:50051";  // as Client takes it
  bool tls = false;
  TlsOptions tls_options;  // any of them implies tls
  std::string token_file;
  bool token_in_clear = false;
};

// --server (or $HYPERMAP_SERVER), --tls, --tls_ca, --tls_cert, --tls_key, --tls_server_name,
// --token_file (or $HYPERMAP_TOKEN_FILE), --token_in_clear. No flag takes the token itself, since
// lists of processes show flags. `flags` must outlive the parser.
void AddConnectionFlags(CLI::App& app, ConnectionFlags& flags);

// Makes a client of flags.server with `options` and the security that the flags ask for. Without a
// token file, the token is $HYPERMAP_TOKEN, if that is set. Errors of CheckTls.
absl::StatusOr<Client> MakeClient(const ConnectionFlags& flags, ClientOptions options);

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_FLAGS_CONNECTION_FLAGS_H_
