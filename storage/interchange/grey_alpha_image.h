// Images with grey and alpha in memory.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_GREY_ALPHA_IMAGE_H_
#define HYPERMAP_STORAGE_INTERCHANGE_GREY_ALPHA_IMAGE_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::storage {

struct GreyAlpha {
  uint8_t grey = 0;
  uint8_t alpha = 255;

  friend bool operator==(const GreyAlpha&, const GreyAlpha&) = default;
};

// `pixels` row-major, top row first.
struct GreyAlphaImage {
  int32_t width = 0;
  int32_t height = 0;
  std::vector<GreyAlpha> pixels;

  const GreyAlpha* row(int32_t y) const { return pixels.data() + int64_t{y} * width; }
  GreyAlpha* row(int32_t y) { return pixels.data() + int64_t{y} * width; }
};

// RESOURCE_EXHAUSTED when an image would have more than `max_pixels` pixels, or more rows or
// columns than a grid can have; INVALID_ARGUMENT when it would have none.
absl::Status CheckImageSize(int64_t width, int64_t height, int64_t max_pixels);

// Decodes a PNG or a PGM, distinguished by the first bytes. INVALID_ARGUMENT, RESOURCE_EXHAUSTED.
absl::StatusOr<GreyAlphaImage> DecodeImage(absl::string_view data, int64_t max_pixels);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_GREY_ALPHA_IMAGE_H_
