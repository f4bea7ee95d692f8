// Checks of certificates and keys in PEM, for both ends of a connection.
#ifndef HYPERMAP_BASE_TLS_PEM_H_
#define HYPERMAP_BASE_TLS_PEM_H_

#include <string>

#include "absl/status/status.h"

namespace hypermap::tls {

// INVALID_ARGUMENT ("holds no certificate in PEM") if the text contains no certificate.
absl::Status CheckCertificates(const std::string& pem);

// INVALID_ARGUMENT if `pem` is not a private key, is encrypted, or is not the key of the first
// certificate in `certificates`. REQUIRES: CheckCertificates(certificates) is OK.
absl::Status CheckKey(const std::string& pem, const std::string& certificates);

}  // namespace hypermap::tls

#endif  // HYPERMAP_BASE_TLS_PEM_H_
