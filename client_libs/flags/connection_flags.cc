#include "client_libs/flags/connection_flags.h"

#include <cstdlib>

#include "base/status/status_macros.h"

namespace hypermap::client {

void AddConnectionFlags(CLI::App& app, ConnectionFlags& flags) {
  app.add_option("--server", flags.server,
                 "Address of the server, or with commas between of several that share their maps: "
                 "the first is asked until it is unavailable, then the next")
      ->envname("HYPERMAP_SERVER")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  app.add_flag("--tls", flags.tls,
               "Encrypt with TLS; trust the certificate authorities of the system");
  app.add_option("--tls_ca", flags.tls_options.root_certificates,
                 "Encrypt with TLS; trust these certificate authorities instead (PEM)")
      ->type_name("FILE");
  app.add_option("--tls_cert", flags.tls_options.certificate_chain,
                 "Client certificate, by which a server may identify the caller (PEM)")
      ->type_name("FILE");
  app.add_option("--tls_key", flags.tls_options.private_key, "Private key of --tls_cert (PEM)")
      ->type_name("FILE");
  app.add_option("--tls_server_name", flags.tls_options.server_name,
                 "Name in the server's certificate, if it differs from the host of --server")
      ->type_name("NAME");
  app.add_option(
         "--token_file", flags.token_file,
         "File with the token to send with each call (default: the token in $HYPERMAP_TOKEN)")
      ->envname("HYPERMAP_TOKEN_FILE")
      ->type_name("FILE");
  app.add_flag("--token_in_clear", flags.token_in_clear,
               "Send the token even if the connection is not encrypted");
}

absl::StatusOr<Client> MakeClient(const ConnectionFlags& flags, ClientOptions options) {
  const TlsOptions& tls = flags.tls_options;
  if (flags.tls || !tls.root_certificates.empty() || !tls.certificate_chain.empty() ||
      !tls.private_key.empty() || !tls.server_name.empty()) {
    HYPERMAP_RETURN_IF_ERROR(CheckTls(tls));
    options.tls = tls;
  }
  const char* token = std::getenv("HYPERMAP_TOKEN");
  if (!flags.token_file.empty()) {
    options.token = TokenFromFile(flags.token_file);
  } else if (token != nullptr && *token != '\0') {
    options.token = [token = std::string(token)] { return token; };
  }
  options.token_in_clear = flags.token_in_clear;
  return Client(flags.server, options);
}

}  // namespace hypermap::client
