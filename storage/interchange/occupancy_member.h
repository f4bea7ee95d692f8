// Occupancy layers from images, for .hmap members and nav2 files.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_OCCUPANCY_MEMBER_H_
#define HYPERMAP_STORAGE_INTERCHANGE_OCCUPANCY_MEMBER_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "map/edits/edit.h"
#include "map/layers/grid_layer.h"
#include "storage/interchange/map_server_yaml.h"

namespace hypermap::storage {

// Appends the edits that create the occupancy layer `name` with the image's content in the frame
// `frame_id` (empty: the map's own). Subtracts the number of pixels from `pixels_left`;
// RESOURCE_EXHAUSTED when too few are left.
absl::Status AppendOccupancyLayer(const std::string& name, const std::string& frame_id,
                                  const MapServerYaml& yaml, absl::string_view image,
                                  int64_t& pixels_left, std::vector<Edit>& edits);

// Appends a line for each property of the layer that an image of its cells can't carry.
void ReportLostByImage(const GridLayer& layer, std::vector<std::string>& omissions);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_OCCUPANCY_MEMBER_H_
