#include "storage/encoding/tile_codec.h"

#include <cmath>
#include <cstdint>
#include <limits>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/occupancy_layer.h"
#include "storage/encoding/tile_image.h"

namespace hypermap::storage {
namespace {

// The index of a cell's pixel in the image; `cell` is its index in TileCodes.
constexpr int PixelOf(int cell) {
  return (kTileSide - 1 - cell / kTileSide) * kTileSide + cell % kTileSide;
}

// A codec for integer codes from 0 to `max_code`.
class IntegerTileCodec : public TileCodec {
 public:
  IntegerTileCodec(int max_code, double scale, const char* quantity)
      : max_code_(max_code), coding_{"integer", scale, scale, kNull, quantity} {}

  const CoverageCoding& coding() const override { return coding_; }

  absl::StatusOr<std::string> Encode(const Tile& tile) const override {
    const TileCodes codes = tile.codes();
    TileImage<uint16_t> image;
    for (int i = 0; i < kCellsPerTile; ++i) {
      const CellCode code = codes[i];
      // Negated, so that a code that compares with nothing (a NaN) would fail as well.
      if (!IsUnknown(code) && !(code >= 0 && code <= max_code_ && std::trunc(code) == code)) {
        return absl::InternalError(absl::StrCat("cell code ", code, " is not of the layer's kind"));
      }
      image[PixelOf(i)] = IsUnknown(code) ? kNull : static_cast<uint16_t>(code);
    }
    return EncodePng(image);
  }

  absl::StatusOr<TilePtr> Decode(absl::string_view data) const override {
    TileImage<uint16_t> image;
    HYPERMAP_RETURN_IF_ERROR(DecodePng(data, &image));
    TileCodes codes;
    codes.fill(kUnknownCode);
    for (int i = 0; i < kCellsPerTile; ++i) {
      const uint16_t pixel = image[PixelOf(i)];
      if (pixel == kNull) continue;
      if (pixel > max_code_) {
        return absl::DataLossError(
            absl::StrCat("pixel value ", pixel, " is above the kind's ", max_code_));
      }
      codes[i] = pixel;
    }
    return Tile::Make(codes);
  }

 private:
  static constexpr uint16_t kNull = 65535;
  int max_code_;
  CoverageCoding coding_;
};

// A codec for finite floats.
class FloatTileCodec : public TileCodec {
 public:
  explicit FloatTileCodec(const char* quantity)
      : coding_{"float", 1.0, std::nullopt, kNull, quantity} {}

  const CoverageCoding& coding() const override { return coding_; }

  absl::StatusOr<std::string> Encode(const Tile& tile) const override {
    const TileCodes codes = tile.codes();
    TileImage<float> image;
    for (int i = 0; i < kCellsPerTile; ++i) {
      const CellCode code = codes[i];
      if (std::isinf(code)) return absl::InternalError("an infinite cell code");
      image[PixelOf(i)] = IsUnknown(code) ? kNull : code == kNull ? kStandsForNull : code;
    }
    return EncodeTiff(image);
  }

  absl::StatusOr<TilePtr> Decode(absl::string_view data) const override {
    TileImage<float> image;
    HYPERMAP_RETURN_IF_ERROR(DecodeTiff(data, &image));
    TileCodes codes;
    codes.fill(kUnknownCode);
    for (int i = 0; i < kCellsPerTile; ++i) {
      const float pixel = image[PixelOf(i)];
      if (pixel == kNull || std::isnan(pixel)) continue;
      if (pixel == std::numeric_limits<float>::infinity()) {
        return absl::DataLossError("an infinite pixel");
      }
      codes[i] = pixel == kStandsForNull ? kNull : pixel;
    }
    return Tile::Make(codes);
  }

 private:
  static constexpr float kNull = std::numeric_limits<float>::lowest();
  static constexpr float kStandsForNull = -std::numeric_limits<float>::infinity();
  CoverageCoding coding_;
};

}  // namespace

std::unique_ptr<const TileCodec> MakeTileCodec(LayerKind kind) {
  constexpr auto kOccupancySteps = static_cast<int>(OccupancyDomain::kStepsPerUnit);
  switch (kind) {
    case LayerKind::kOccupancy:
      return std::make_unique<IntegerTileCodec>(kOccupancySteps, 0.0001,
                                                "probability of occupation");
    case LayerKind::kExploration:
      return std::make_unique<IntegerTileCodec>(1, 1.0, "explored");
    case LayerKind::kScalar:
      return std::make_unique<FloatTileCodec>("measured value");
    case LayerKind::kSemantic:
      return nullptr;
  }
  return nullptr;
}

bool KnownOnlyIn(const CellBox& extent, const TileIndex& index, const Tile& tile) {
  const CellBox cells = CellsOf(index);
  if (extent.Contains(cells)) return true;
  for (int32_t row = 0; row < kTileSide; ++row) {
    for (int32_t col = 0; col < kTileSide; ++col) {
      const CellIndex cell{cells.row_begin + row, cells.col_begin + col};
      if (!IsUnknown(tile.at(row, col)) && !extent.Contains(cell)) return false;
    }
  }
  return true;
}

}  // namespace hypermap::storage
