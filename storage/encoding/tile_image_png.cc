#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/images/png.h"
#include "base/status/status_macros.h"
#include "storage/encoding/tile_image.h"

namespace hypermap::storage {
namespace {

constexpr int kBitDepth = 16;
constexpr size_t kRowBytes = kTileSide * kBitDepth / 8;

absl::Status Damaged(absl::string_view message) {
  return absl::DataLossError(absl::StrCat("PNG: ", message));
}

}  // namespace

absl::StatusOr<std::string> EncodePng(const TileImage<uint16_t>& image) {
  // Maps are mostly runs of equal cells, which fast settings pack nearly as well.
  HYPERMAP_ASSIGN_OR_RETURN(
      PngWriter writer,
      PngWriter::Begin(
          {.width = kTileSide, .height = kTileSide, .bit_depth = kBitDepth, .is_fast = true}));
  std::array<uint8_t, kRowBytes> row;
  for (int y = 0; y < kTileSide; ++y) {
    for (int x = 0; x < kTileSide; ++x) {
      const uint16_t pixel = image[y * kTileSide + x];
      row[2 * x] = static_cast<uint8_t>(pixel >> 8);
      row[2 * x + 1] = static_cast<uint8_t>(pixel & 0xFF);
    }
    HYPERMAP_RETURN_IF_ERROR(writer.WriteRow(row.data()));
  }
  return std::move(writer).Finish();
}

absl::Status DecodePng(absl::string_view data, TileImage<uint16_t>* image) {
  // A tile is decoded soon. Broken off in the middle, it would be taken for a damaged one.
  const ScopedCancellation to_the_end(nullptr);
  absl::StatusOr<PngReader> reader = PngReader::Open(data, kTileSide, kTileSide);
  if (!reader.ok()) return Damaged(reader.status().message());
  const PngHeader& header = reader->header();
  if (header.width != kTileSide || header.height != kTileSide || header.bit_depth != kBitDepth ||
      !header.is_grey) {
    return Damaged("not a 16-bit grey image of a tile's size");
  }
  std::vector<uint8_t> bytes(kRowBytes * kTileSide);
  if (absl::Status status = reader->ReadRows(bytes.data()); !status.ok()) {
    return Damaged(status.message());
  }
  for (size_t i = 0; i < image->size(); ++i) {
    (*image)[i] = static_cast<uint16_t>(bytes[2 * i] << 8 | bytes[2 * i + 1]);
  }
  return absl::OkStatus();
}

}  // namespace hypermap::storage
