#include "ingest/sources/depth_png.h"

#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/images/png.h"
#include "base/status/status_macros.h"

namespace hypermap::ingest {

absl::StatusOr<DepthImage> DecodeDepthPng(absl::string_view data, int width, int height,
                                          double units_per_metre) {
  HYPERMAP_ASSIGN_OR_RETURN(PngReader reader, PngReader::Open(data));
  const PngHeader& header = reader.header();
  if (!header.is_grey || header.bit_depth != 16) {
    return absl::InvalidArgumentError("the depth image is no grey PNG of 16 bits");
  }
  if (header.width != width || header.height != height) {
    return absl::InvalidArgumentError(absl::StrCat("depth image of ", header.width, "x",
                                                   header.height, " for a camera of ", width, "x",
                                                   height));
  }
  std::vector<uint8_t> bytes(reader.row_bytes() * height);
  HYPERMAP_RETURN_IF_ERROR(reader.ReadRows(bytes.data()));
  DepthImage image{width, height, {}};
  image.metres.resize(static_cast<size_t>(width) * height);
  const float metres_per_unit = static_cast<float>(1.0 / units_per_metre);
  for (size_t i = 0; i < image.metres.size(); ++i) {
    image.metres[i] = static_cast<float>(bytes[2 * i] << 8 | bytes[2 * i + 1]) * metres_per_unit;
  }
  return image;
}

}  // namespace hypermap::ingest
