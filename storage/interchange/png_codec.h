// Grey and alpha of PNG images.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_PNG_CODEC_H_
#define HYPERMAP_STORAGE_INTERCHANGE_PNG_CODEC_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/interchange/grey_alpha_image.h"

namespace hypermap::storage {

// Any PNG as 8-bit grey and alpha, sample by sample as stb_image does it for the original system:
// no gamma; the high byte of 16 bits; colour c to grey by (77 r + 150 g + 29 b) >> 8.
absl::StatusOr<GreyAlphaImage> DecodePng(absl::string_view data, int64_t max_pixels);

enum class PngChannels { kGrey, kGreyAlpha };

// 8 bits a sample.
absl::StatusOr<std::string> EncodePng(const GreyAlphaImage& image, PngChannels channels);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_PNG_CODEC_H_
