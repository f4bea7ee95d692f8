// Bytes as they are kept: deflated.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_PACKED_BYTES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_PACKED_BYTES_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::storage {

// A zlib stream (RFC 1950).
std::string PackBytes(absl::string_view bytes);

// `size` is of the bytes that were packed. DATA_LOSS when `packed` is not what they became.
absl::StatusOr<std::string> UnpackBytes(absl::string_view packed, int64_t size);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_PACKED_BYTES_H_
