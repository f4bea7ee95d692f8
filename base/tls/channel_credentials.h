// The TLS credentials of whoever connects to a server.
#ifndef HYPERMAP_BASE_TLS_CHANNEL_CREDENTIALS_H_
#define HYPERMAP_BASE_TLS_CHANNEL_CREDENTIALS_H_

#include <grpcpp/security/credentials.h>

#include <memory>
#include <string>

namespace hypermap::tls {

// Paths of PEM files.
struct ChannelFiles {
  // The authorities that sign the server's certificate. Empty: those that the system trusts.
  std::string root_certificates;
  // The own certificate with its intermediates, and its key, not encrypted. Both or none.
  std::string certificate_chain;
  std::string private_key;
};

// Reads the files again every few seconds. New connections use renewed ones; those that are open go
// on. REQUIRES: the files can be used, since gRPC aborts if a certificate has no key.
std::shared_ptr<grpc::ChannelCredentials> MakeChannelCredentials(const ChannelFiles& files);

}  // namespace hypermap::tls

#endif  // HYPERMAP_BASE_TLS_CHANNEL_CREDENTIALS_H_
