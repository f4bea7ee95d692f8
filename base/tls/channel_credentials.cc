#include "base/tls/channel_credentials.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include "base/tls/tls_file.h"

namespace hypermap::tls {

std::shared_ptr<grpc::ChannelCredentials> MakeChannelCredentials(const ChannelFiles& files) {
  const bool has_roots = !files.root_certificates.empty();
  const bool has_certificate = !files.certificate_chain.empty();
  grpc::experimental::TlsChannelCredentialsOptions options;
  if (has_roots || has_certificate) {
    options.set_certificate_provider(
        std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(
            files.private_key, files.certificate_chain, files.root_certificates,
            kReadAgainSeconds));
  }
  if (has_roots) options.watch_root_certs();
  if (has_certificate) options.watch_identity_key_cert_pairs();
  return grpc::experimental::TlsCredentials(options);
}

}  // namespace hypermap::tls
