// Layers of occupancy images: what .hmap members and nav2 files have in common.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_OCCUPANCY_MEMBER_H_
#define HYPERMAP_STORAGE_INTERCHANGE_OCCUPANCY_MEMBER_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "map/edits/edit.h"
#include "map/layers/grid/grid_layer.h"
#include "storage/interchange/map_server_yaml.h"

namespace hypermap::storage {

// Appends the edits that make the occupancy layer `name` with the image's content. `frame_id` may
// be empty: the map's own. Takes the image's pixels off `pixels_left`, which bounds them.
absl::Status AppendOccupancyLayer(const std::string& name, const std::string& frame_id,
                                  const MapServerYaml& yaml, absl::string_view image,
                                  int64_t& pixels_left, std::vector<Edit>& edits);

// Adds the lines for what no image of a grid says.
void ReportLostByImage(const GridLayer& layer, std::vector<std::string>& omissions);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_OCCUPANCY_MEMBER_H_
