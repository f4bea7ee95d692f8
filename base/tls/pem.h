// Certificates and keys, as both ends of a connection are given them: texts in PEM.
#ifndef HYPERMAP_BASE_TLS_PEM_H_
#define HYPERMAP_BASE_TLS_PEM_H_

#include <string>

#include "absl/status/status.h"

namespace hypermap::tls {

// INVALID_ARGUMENT, "holds no certificate in PEM".
absl::Status CheckCertificates(const std::string& pem);

// INVALID_ARGUMENT for what is no private key, for an encrypted one, and for that of another than
// the first of `certificates`, which are certificates.
absl::Status CheckKey(const std::string& pem, const std::string& certificates);

}  // namespace hypermap::tls

#endif  // HYPERMAP_BASE_TLS_PEM_H_
