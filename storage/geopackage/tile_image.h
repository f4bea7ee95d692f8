// Square images of kTileSide x kTileSide pixels in memory, row-major from the top. What is decoded
// is untrusted: any size, type or damage that the encoders would not have made is DATA_LOSS, with
// memory bounded by that of one tile.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TILE_IMAGE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TILE_IMAGE_H_

#include <array>
#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/layers/grid/tile.h"

namespace hypermap::storage {

template <typename Pixel>
using TileImage = std::array<Pixel, kTileSide * kTileSide>;

// 16-bit grey PNG.
absl::StatusOr<std::string> EncodePng(const TileImage<uint16_t>& image);
absl::Status DecodePng(absl::string_view data, TileImage<uint16_t>* image);

// 32-bit float TIFF, one image in strips, LZW (read: also uncompressed).
absl::StatusOr<std::string> EncodeTiff(const TileImage<float>& image);
absl::Status DecodeTiff(absl::string_view data, TileImage<float>* image);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TILE_IMAGE_H_
