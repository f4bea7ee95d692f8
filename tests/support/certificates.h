// Certificates for one test, made by the command openssl.
#ifndef HYPERMAP_TESTS_SUPPORT_CERTIFICATES_H_
#define HYPERMAP_TESTS_SUPPORT_CERTIFICATES_H_

#include <string>

#include "tests/support/temporary_folder.h"

namespace hypermap::testing {

// A root certificate and the certificates that it signs, as NAME.pem and NAME.key in a folder.
// Throws std::runtime_error if openssl fails.
class CertificateAuthority {
 public:
  // Makes `name`.pem and `name`.key of the root.
  CertificateAuthority(const TemporaryFolder& folder, const std::string& name);

  // Makes a certificate with these subject alternative names, as openssl writes them.
  void Sign(const std::string& name,
            const std::string& alternative_names = "DNS:localhost,IP:127.0.0.1") const;

 private:
  const TemporaryFolder& folder_;
  const std::string name_;
};

// Returns the content of a file.
std::string Contents(const std::string& path);

}  // namespace hypermap::testing

#endif  // HYPERMAP_TESTS_SUPPORT_CERTIFICATES_H_
