// Portable graymaps (netpbm).
#ifndef HYPERMAP_STORAGE_INTERCHANGE_PGM_H_
#define HYPERMAP_STORAGE_INTERCHANGE_PGM_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/interchange/grey_alpha_image.h"

namespace hypermap::storage {

// Decodes the first image of a file in the binary (P5) or plain (P2) form. Samples are scaled from
// 0..maxval to 0..255 and rounded; all pixels are opaque.
absl::StatusOr<GreyAlphaImage> DecodePgm(absl::string_view data, int64_t max_pixels);

// Encodes P5 with maxval 255; alpha is left out.
std::string EncodePgm(const GreyAlphaImage& image);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_PGM_H_
