// Compression of large columns.
#ifndef HYPERMAP_STORAGE_ENCODING_PACKED_BYTES_H_
#define HYPERMAP_STORAGE_ENCODING_PACKED_BYTES_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::storage {

// Compresses to a zlib stream (RFC 1950).
std::string PackBytes(absl::string_view bytes);

// Decompresses; `size` is the size of the original bytes. DATA_LOSS when `packed` is not a stream
// of that many bytes.
absl::StatusOr<std::string> UnpackBytes(absl::string_view packed, int64_t size);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_ENCODING_PACKED_BYTES_H_
