#include "storage/interchange/png_codec.h"

#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "base/cancellation/cancellation.h"
#include "base/images/png.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {
namespace {

// Memory of a decoded pixel: 2 bytes of the image, and up to 4 of the rows of an interlaced file.
constexpr int64_t kBytesOfDecodedPixel = 6;

// Deflate can't pack tighter than 1032:1 (zlib's technical notes), so a file that claims more
// pixels than that for its size does not have them.
constexpr int64_t kMaxDeflateRatio = 1032;

GreyAlpha ToGreyAlpha(const uint8_t* p, int channels) {
  const bool coloured = channels >= 3;
  const bool has_alpha = channels == 2 || channels == 4;
  const int grey = coloured ? (77 * p[0] + 150 * p[1] + 29 * p[2]) >> 8 : p[0];
  return {static_cast<uint8_t>(grey), has_alpha ? p[channels - 1] : uint8_t{255}};
}

void AppendRow(const uint8_t* row, int channels, GreyAlphaImage& image) {
  for (int32_t x = 0; x < image.width; ++x) {
    image.pixels.push_back(ToGreyAlpha(row + int64_t{x} * channels, channels));
  }
}

absl::Status ReadPixels(PngReader& reader, GreyAlphaImage& image) {
  // Only the passes of an interlaced image need all rows in memory.
  if (reader.num_passes() == 1) {
    std::vector<uint8_t> row(reader.row_bytes());
    for (int32_t y = 0; y < image.height; ++y) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      HYPERMAP_RETURN_IF_ERROR(reader.ReadRow(row.data()));
      AppendRow(row.data(), reader.channels(), image);
    }
    return absl::OkStatus();
  }
  std::vector<uint8_t> rows(reader.row_bytes() * image.height);
  HYPERMAP_RETURN_IF_ERROR(reader.ReadRows(rows.data()));
  for (int32_t y = 0; y < image.height; ++y) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    AppendRow(rows.data() + reader.row_bytes() * y, reader.channels(), image);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<GreyAlphaImage> DecodePng(absl::string_view data, int64_t max_pixels) {
  HYPERMAP_ASSIGN_OR_RETURN(PngReader reader, PngReader::Open(data));
  const PngHeader& header = reader.header();
  HYPERMAP_RETURN_IF_ERROR(CheckImageSize(header.width, header.height, max_pixels));
  // Rows as they are packed in the file, before they are widened to 8 bits a sample.
  if (reader.row_bytes() * header.height / kMaxDeflateRatio > static_cast<int64_t>(data.size())) {
    return absl::InvalidArgumentError("broken PNG: it is too short for its dimensions");
  }
  HYPERMAP_RETURN_IF_ERROR(reader.ExpandTo8Bits());
  HYPERMAP_RETURN_IF_ERROR(
      TakeMemory(kBytesOfDecodedPixel * int64_t{header.width} * header.height));
  GreyAlphaImage image{static_cast<int32_t>(header.width), static_cast<int32_t>(header.height), {}};
  image.pixels.reserve(header.width * header.height);
  HYPERMAP_RETURN_IF_ERROR(ReadPixels(reader, image));
  return image;
}

absl::StatusOr<std::string> EncodePng(const GreyAlphaImage& image, PngChannels channels) {
  const bool with_alpha = channels == PngChannels::kGreyAlpha;
  HYPERMAP_ASSIGN_OR_RETURN(
      PngWriter writer,
      PngWriter::Begin({.width = image.width, .height = image.height, .has_alpha = with_alpha}));
  std::vector<uint8_t> row;
  for (int32_t y = 0; y < image.height; ++y) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    row.clear();
    for (int32_t x = 0; x < image.width; ++x) {
      const GreyAlpha& pixel = image.row(y)[x];
      row.push_back(pixel.grey);
      if (with_alpha) row.push_back(pixel.alpha);
    }
    HYPERMAP_RETURN_IF_ERROR(writer.WriteRow(row.data()));
  }
  return std::move(writer).Finish();
}

}  // namespace hypermap::storage
