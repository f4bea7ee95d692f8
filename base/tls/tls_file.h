// Reads files of certificates, keys and tokens.
#ifndef HYPERMAP_BASE_TLS_TLS_FILE_H_
#define HYPERMAP_BASE_TLS_TLS_FILE_H_

#include <string>

#include "absl/status/statusor.h"

namespace hypermap::tls {

// How often gRPC reads the files again that it was given.
inline constexpr unsigned int kReadAgainSeconds = 5;

// Returns the content of a file. Errors name the file: NOT_FOUND, PERMISSION_DENIED and the like.
absl::StatusOr<std::string> ReadFile(const std::string& path);

}  // namespace hypermap::tls

#endif  // HYPERMAP_BASE_TLS_TLS_FILE_H_
