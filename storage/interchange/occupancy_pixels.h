// Converts the pixels of occupancy images to cells, and grids to such images.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_OCCUPANCY_PIXELS_H_
#define HYPERMAP_STORAGE_INTERCHANGE_OCCUPANCY_PIXELS_H_

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/edits/edit.h"
#include "map/layers/grid_layer.h"
#include "storage/interchange/grey_alpha_image.h"
#include "storage/interchange/map_server_yaml.h"

namespace hypermap::storage {

// The occupancy of a pixel under the rules of a YAML (docs/hmap_format.md), in hundredths: none of
// the three modes gives finer values.
class PixelMeaning {
 public:
  static constexpr uint8_t kUnknown = 255;

  explicit PixelMeaning(const MapServerYaml& yaml);

  // 0..100 or kUnknown.
  uint8_t PercentOf(const GreyAlpha& pixel) const {
    return pixel.alpha == 255 || !needs_opaque_ ? percent_of_grey_[pixel.grey] : kUnknown;
  }

 private:
  bool needs_opaque_;
  std::array<uint8_t, 256> percent_of_grey_;
};

// Appends the edits that write `image` to the empty layer `layer`, with the lower left pixel in
// cell (0, 0). They make the whole image the layer's extent, but write only the parts that have
// known cells. Errors of CheckCancelled and TakeMemory.
absl::Status AppendCells(const GreyAlphaImage& image, const PixelMeaning& meaning,
                         const std::string& layer, std::vector<Edit>& edits);

// The cells of a grid's extent in hundredths: row-major, top row first, PixelMeaning::kUnknown
// where unknown.
struct GridPicture {
  GridGeometry geometry;  // cell (0, 0) is the lower left one of the picture
  int32_t width = 0;
  int32_t height = 0;
  std::vector<uint8_t> percents;
  int64_t num_rounded = 0;  // cells whose value is not a multiple of 1/100
};

// REQUIRES: `layer` is of the kind occupancy and its extent is not empty. RESOURCE_EXHAUSTED when
// it has more than `max_pixels` cells; errors of TakeMemory.
absl::StatusOr<GridPicture> TakePicture(const GridLayer& layer, int64_t max_pixels);

// The image that the original writes: unknown is (127, transparent), v hundredths are (round(255 -
// 2.55 v), opaque). Mode scale with the thresholds 1 and 0 reads every value back exactly.
GreyAlphaImage ScaleImage(const GridPicture& picture);

// The image that map_saver writes: free 254, occupied 0, everything else 205, all opaque.
GreyAlphaImage TrinaryImage(const GridPicture& picture, const OccupancyThresholds& thresholds);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_OCCUPANCY_PIXELS_H_
