#include "storage/interchange/occupancy_pixels.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "storage/interchange/status_context.h"

namespace hypermap::storage {
namespace {

// Cells are written in blocks of the size of a tile, so that blocks of unknown cells are left out,
// as a grid leaves out unknown tiles.
constexpr int32_t kBlockSide = kTileSide;

// Memory of a pixel: one byte of the picture, and two of the image that is made of it; rounded up.
constexpr int64_t kBytesOfPicturePixel = 4;

uint8_t ScaledPercent(double occupancy, const MapServerYaml& yaml) {
  const double ratio = (occupancy - yaml.free_thresh) / (yaml.occupied_thresh - yaml.free_thresh);
  // With equal thresholds, no occupancy lies between them.
  if (!std::isfinite(ratio)) return PixelMeaning::kUnknown;
  return static_cast<uint8_t>(std::clamp(std::round(100.0 * ratio), 0.0, 100.0));
}

uint8_t PercentOfGrey(int grey, const MapServerYaml& yaml) {
  const int c = yaml.negate ? 255 - grey : grey;
  if (yaml.mode == OccupancyMode::kRaw) {
    return c <= 100 ? static_cast<uint8_t>(c) : PixelMeaning::kUnknown;
  }
  const double occupancy = (255 - c) / 255.0;
  if (occupancy > yaml.occupied_thresh) return 100;
  if (occupancy < yaml.free_thresh) return 0;
  return yaml.mode == OccupancyMode::kScale ? ScaledPercent(occupancy, yaml)
                                            : PixelMeaning::kUnknown;
}

// Converts a band of kBlockSide rows to edits.
class BandWriter {
 public:
  BandWriter(const GreyAlphaImage& image, const PixelMeaning& meaning, const std::string& layer,
             int32_t row_begin)
      : image_(image),
        meaning_(meaning),
        layer_(layer),
        row_begin_(row_begin),
        row_end_(std::min(row_begin + kBlockSide, image.height)) {}

  // Adds one edit for each run of neighbouring blocks with known cells.
  absl::Status AppendTo(std::vector<Edit>& edits) const {
    for (int32_t col = 0; col < image_.width; col += kBlockSide) {
      if (!HoldsKnown(col)) continue;
      const int32_t col_begin = col;
      while (col < image_.width && HoldsKnown(col)) col += kBlockSide;
      const CellBox box{row_begin_, row_end_, col_begin, std::min(col, image_.width)};
      HYPERMAP_RETURN_IF_ERROR(
          TakeMemory(box.num_cells() * static_cast<int64_t>(sizeof(std::optional<double>))));
      edits.push_back(Cells(box));
    }
    return absl::OkStatus();
  }

 private:
  // Cell row 0 is the lowest; image row 0 is the highest.
  const GreyAlpha* ImageRow(int32_t row) const { return image_.row(image_.height - 1 - row); }

  bool HoldsKnown(int32_t col_begin) const {
    const int32_t col_end = std::min(col_begin + kBlockSide, image_.width);
    for (int32_t row = row_begin_; row < row_end_; ++row) {
      const GreyAlpha* pixels = ImageRow(row);
      for (int32_t col = col_begin; col < col_end; ++col) {
        if (meaning_.PercentOf(pixels[col]) != PixelMeaning::kUnknown) return true;
      }
    }
    return false;
  }

  WriteCells Cells(const CellBox& box) const {
    WriteCells edit{layer_, box, {}};
    edit.values.reserve(box.num_cells());
    for (int32_t row = box.row_begin; row < box.row_end; ++row) {
      const GreyAlpha* pixels = ImageRow(row);
      for (int32_t col = box.col_begin; col < box.col_end; ++col) {
        const uint8_t percent = meaning_.PercentOf(pixels[col]);
        if (percent == PixelMeaning::kUnknown) {
          edit.values.push_back(std::nullopt);
        } else {
          edit.values.push_back(percent / 100.0);
        }
      }
    }
    return edit;
  }

  const GreyAlphaImage& image_;
  const PixelMeaning& meaning_;
  const std::string& layer_;
  int32_t row_begin_;
  int32_t row_end_;
};

WriteCells UnknownCell(const std::string& layer, int32_t row, int32_t col) {
  return {layer, {row, row + 1, col, col + 1}, {std::nullopt}};
}

}  // namespace

PixelMeaning::PixelMeaning(const MapServerYaml& yaml)
    : needs_opaque_(yaml.mode != OccupancyMode::kRaw) {
  for (int grey = 0; grey < 256; ++grey) percent_of_grey_[grey] = PercentOfGrey(grey, yaml);
}

absl::Status AppendCells(const GreyAlphaImage& image, const PixelMeaning& meaning,
                         const std::string& layer, std::vector<Edit>& edits) {
  std::vector<Edit> known;
  for (int32_t row = 0; row < image.height; row += kBlockSide) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    HYPERMAP_RETURN_IF_ERROR(BandWriter(image, meaning, layer, row).AppendTo(known));
  }
  CellBox written;
  for (const Edit& edit : known) written = written.Union(std::get<WriteCells>(edit).box);
  if (written != CellBox{0, image.height, 0, image.width}) {
    edits.push_back(UnknownCell(layer, 0, 0));
    edits.push_back(UnknownCell(layer, image.height - 1, image.width - 1));
  }
  std::move(known.begin(), known.end(), std::back_inserter(edits));
  return absl::OkStatus();
}

namespace {

// Puts the cells of one tile that lie in `extent` into the picture.
void DrawTile(const Tile& tile, const CellBox& cells, const CellBox& extent,
              const CellDomain& domain, GridPicture& picture) {
  const CellBox visible = cells.Intersection(extent);
  for (int32_t row = visible.row_begin; row < visible.row_end; ++row) {
    uint8_t* out = picture.percents.data() + int64_t{extent.row_end - 1 - row} * picture.width;
    for (int32_t col = visible.col_begin; col < visible.col_end; ++col) {
      const CellCode code = tile.at(row - cells.row_begin, col - cells.col_begin);
      if (IsUnknown(code)) continue;
      const double hundredths = domain.Decode(code) * 100.0;
      const double rounded = std::round(hundredths);
      // Values are held in steps of 1/10,000: a real difference is far above rounding noise.
      if (std::abs(hundredths - rounded) > 1e-6) ++picture.num_rounded;
      out[col - extent.col_begin] = static_cast<uint8_t>(rounded);
    }
  }
}

}  // namespace

absl::StatusOr<GridPicture> TakePicture(const GridLayer& layer, int64_t max_pixels) {
  const CellBox& extent = layer.extent();
  if (auto status = CheckImageSize(extent.cols(), extent.rows(), max_pixels); !status.ok()) {
    return At(absl::StrCat("layer \"", layer.spec().name, "\""), status);
  }
  const GridGeometry& geometry = layer.geometry();
  const PlanarTransform& origin = geometry.layer_from_grid;
  const Point corner = origin * Point{extent.col_begin * geometry.resolution_m,
                                      extent.row_begin * geometry.resolution_m};
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesOfPicturePixel * extent.num_cells()));
  GridPicture picture;
  picture.geometry = {PlanarTransform(corner.x, corner.y, origin.yaw()), geometry.resolution_m};
  picture.width = static_cast<int32_t>(extent.cols());
  picture.height = static_cast<int32_t>(extent.rows());
  picture.percents.assign(extent.num_cells(), PixelMeaning::kUnknown);
  for (const auto& [index, tile] : layer.tiles()) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    DrawTile(*tile, CellsOf(index), extent, layer.domain(), picture);
  }
  return picture;
}

GreyAlphaImage ScaleImage(const GridPicture& picture) {
  std::array<GreyAlpha, 256> pixel_of;
  pixel_of.fill({127, 0});
  for (int percent = 0; percent <= 100; ++percent) {
    pixel_of[percent] = {static_cast<uint8_t>(std::round(255.0 - 2.55 * percent)), 255};
  }
  GreyAlphaImage image{picture.width, picture.height, {}};
  image.pixels.reserve(picture.percents.size());
  for (const uint8_t percent : picture.percents) image.pixels.push_back(pixel_of[percent]);
  return image;
}

GreyAlphaImage TrinaryImage(const GridPicture& picture, const OccupancyThresholds& thresholds) {
  std::array<GreyAlpha, 256> pixel_of;
  pixel_of.fill({205, 255});
  for (int percent = 0; percent <= 100; ++percent) {
    if (percent / 100.0 > thresholds.occupied_above) pixel_of[percent] = {0, 255};
    if (percent / 100.0 < thresholds.free_below) pixel_of[percent] = {254, 255};
  }
  // Cells that are certainly free or occupied stay so, whatever the thresholds are.
  pixel_of[0] = {254, 255};
  pixel_of[100] = {0, 255};
  GreyAlphaImage image{picture.width, picture.height, {}};
  image.pixels.reserve(picture.percents.size());
  for (const uint8_t percent : picture.percents) image.pixels.push_back(pixel_of[percent]);
  return image;
}

}  // namespace hypermap::storage
