// What the pixels of an occupancy image mean, and grids as such images.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_OCCUPANCY_PIXELS_H_
#define HYPERMAP_STORAGE_INTERCHANGE_OCCUPANCY_PIXELS_H_

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/edits/edit.h"
#include "map/layers/grid/grid_layer.h"
#include "storage/interchange/grey_alpha_image.h"
#include "storage/interchange/map_server_yaml.h"

namespace hypermap::storage {

// The occupancy of a pixel under the rules of a YAML (docs/hmap_format.md): in hundredths, as all
// three modes give no finer ones.
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

// Appends the edits that write `image` into the empty layer `layer`, its lower left pixel into cell
// (0, 0). Afterwards the layer's extent is the whole image; memory is taken for those parts of it
// only that hold something known.
void AppendCells(const GreyAlphaImage& image, const PixelMeaning& meaning, const std::string& layer,
                 std::vector<Edit>& edits);

// The extent of a grid, and its cells in hundredths: row-major, top row first,
// PixelMeaning::kUnknown where unknown.
struct GridPicture {
  GridGeometry geometry;  // cell (0, 0) is the lower left one of the picture
  int32_t width = 0;
  int32_t height = 0;
  std::vector<uint8_t> percents;
  int64_t num_rounded = 0;  // cells whose value is no multiple of 1/100
};

// `layer` of the kind occupancy, its extent not empty. RESOURCE_EXHAUSTED past `max_pixels`.
absl::StatusOr<GridPicture> TakePicture(const GridLayer& layer, int64_t max_pixels);

// As the original writes it: unknown (127, transparent), v (round(255 - 2.55 v), opaque). Read back
// with mode scale and the thresholds 1 and 0 each value is itself again.
GreyAlphaImage ScaleImage(const GridPicture& picture);

// As map_saver writes it: free 254, occupied 0, everything else 205, all opaque.
GreyAlphaImage TrinaryImage(const GridPicture& picture, const OccupancyThresholds& thresholds);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_OCCUPANCY_PIXELS_H_
