#include "storage/interchange/grey_alpha_image.h"

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "map/grid/grid_geometry.h"
#include "storage/interchange/pgm.h"
#include "storage/interchange/png_codec.h"

namespace hypermap::storage {

absl::Status CheckImageSize(int64_t width, int64_t height, int64_t max_pixels) {
  if (width <= 0 || height <= 0) return absl::InvalidArgumentError("image has no pixels");
  if (width > kMaxCellIndex || height > kMaxCellIndex) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "image is ", width, " x ", height, " pixels, a grid has up to ", kMaxCellIndex, " a side"));
  }
  if (width * height > max_pixels) {
    return absl::ResourceExhaustedError(absl::StrCat("image is ", width, " x ", height,
                                                     " pixels, the limit is ", max_pixels,
                                                     " (of an import: --max_cells)"));
  }
  return absl::OkStatus();
}

absl::StatusOr<GreyAlphaImage> DecodeImage(absl::string_view data, int64_t max_pixels) {
  if (absl::StartsWith(data, "\x89PNG")) return DecodePng(data, max_pixels);
  if (absl::StartsWith(data, "P5") || absl::StartsWith(data, "P2")) {
    return DecodePgm(data, max_pixels);
  }
  return absl::InvalidArgumentError("image is neither PNG nor PGM");
}

}  // namespace hypermap::storage
