#include "storage/encoding/packed_bytes.h"

#include <zlib.h>

#include "absl/status/status.h"

namespace hypermap::storage {
namespace {

constexpr int64_t kMaxSize = int64_t{1} << 30;
// Upper bound of the ratio of Deflate (zlib's "Maximum Compression Factor").
constexpr int64_t kMaxDeflateRatio = 1032;

}  // namespace

std::string PackBytes(absl::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  // Can't fail with a buffer of compressBound bytes.
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
            reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), Z_BEST_SPEED);
  packed.resize(size);
  return packed;
}

absl::StatusOr<std::string> UnpackBytes(absl::string_view packed, int64_t size) {
  // Checked before memory is allocated, because the file may be damaged.
  if (size < 0 || size > kMaxSize ||
      size > kMaxDeflateRatio * (static_cast<int64_t>(packed.size()) + 1)) {
    return absl::DataLossError("packed bytes: the size cannot be right");
  }
  std::string bytes(static_cast<size_t>(size), '\0');
  uLongf unpacked = bytes.size();
  const int code = uncompress(reinterpret_cast<Bytef*>(bytes.data()), &unpacked,
                              reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (code == Z_OK && unpacked == bytes.size()) return bytes;
  return absl::DataLossError("packed bytes: damaged");
}

}  // namespace hypermap::storage
