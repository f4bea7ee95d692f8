#include "storage/interchange/occupancy_member.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "storage/interchange/grey_alpha_image.h"
#include "storage/interchange/number_text.h"
#include "storage/interchange/occupancy_pixels.h"
#include "storage/interchange/status_context.h"

namespace hypermap::storage {

absl::Status AppendOccupancyLayer(const std::string& name, const std::string& frame_id,
                                  const MapServerYaml& yaml, absl::string_view image,
                                  int64_t& pixels_left, std::vector<Edit>& edits) {
  LayerSpec spec;
  spec.name = name;
  spec.kind = LayerKind::kOccupancy;
  spec.grid = yaml.geometry;
  // A layer without a frame gets the map's frame when it is created. Validation needs some name, so
  // that all other errors are found here.
  spec.frame_id = frame_id.empty() ? "map" : frame_id;
  HYPERMAP_RETURN_IF_ERROR(Validate(spec));
  spec.frame_id = frame_id;

  const absl::StatusOr<GreyAlphaImage> pixels = DecodeImage(image, pixels_left);
  if (!pixels.ok()) return At(absl::StrCat("image \"", yaml.image, "\""), pixels.status());
  pixels_left -= static_cast<int64_t>(pixels->pixels.size());
  edits.push_back(CreateLayer{std::move(spec)});
  return AppendCells(*pixels, PixelMeaning(yaml), name, edits);
}

void ReportLostByImage(const GridLayer& layer, std::vector<std::string>& omissions) {
  const OccupancyThresholds& thresholds = layer.spec().thresholds;
  if (thresholds == OccupancyThresholds()) return;
  omissions.push_back(absl::StrCat("layer \"", layer.spec().name, "\": its thresholds, free below ",
                                   FormatNumber(thresholds.free_below), " and occupied above ",
                                   FormatNumber(thresholds.occupied_above)));
}

}  // namespace hypermap::storage
