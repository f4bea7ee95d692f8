// Codecs of square images of kTileSide x kTileSide pixels, row-major from the top. Encoded images
// are not trusted: any size, type or damage that the encoders would not have made is DATA_LOSS, and
// decoding takes no more memory than one tile needs.
#ifndef HYPERMAP_STORAGE_ENCODING_TILE_IMAGE_H_
#define HYPERMAP_STORAGE_ENCODING_TILE_IMAGE_H_

#include <array>
#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/grid/tile.h"

namespace hypermap::storage {

template <typename Pixel>
using TileImage = std::array<Pixel, kTileSide * kTileSide>;

// 16-bit grey PNG.
absl::StatusOr<std::string> EncodePng(const TileImage<uint16_t>& image);
absl::Status DecodePng(absl::string_view data, TileImage<uint16_t>* image);

// 32-bit float TIFF: one image in strips, LZW. Uncompressed images are decoded too.
absl::StatusOr<std::string> EncodeTiff(const TileImage<float>& image);
absl::Status DecodeTiff(absl::string_view data, TileImage<float>* image);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_ENCODING_TILE_IMAGE_H_
