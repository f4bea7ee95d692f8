// Certificates and keys, as both ends of a connection are given them: texts in PEM.
#ifndef HYPERMAP_WIRE_PEM_H_
#define HYPERMAP_WIRE_PEM_H_

#include <string>

#include "absl/status/status.h"

namespace hypermap::wire {

// INVALID_ARGUMENT, "holds no certificate in PEM".
absl::Status CheckCertificates(const std::string& pem);

// INVALID_ARGUMENT for what is no private key, for an encrypted one, and for that of another than
// the first of `certificates`, which are certificates.
absl::Status CheckKey(const std::string& pem, const std::string& certificates);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_PEM_H_
