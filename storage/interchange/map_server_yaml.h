// The YAML that describes an occupancy image: that of map_server, nav2 and the original Hypermap.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_MAP_SERVER_YAML_H_
#define HYPERMAP_STORAGE_INTERCHANGE_MAP_SERVER_YAML_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/grid/grid_geometry.h"

namespace hypermap::storage {

enum class OccupancyMode { kTrinary, kScale, kRaw };

struct MapServerYaml {
  std::string image;
  // Cell (0, 0) is the lower left pixel.
  GridGeometry geometry;
  bool negate = false;
  double occupied_thresh = 0.65;
  double free_thresh = 0.196;
  OccupancyMode mode = OccupancyMode::kTrinary;
};

// Keys other than image, resolution and origin may be absent; unknown ones are ignored.
// INVALID_ARGUMENT naming the key.
absl::StatusOr<MapServerYaml> ParseMapServerYaml(absl::string_view text);

std::string FormatMapServerYaml(const MapServerYaml& yaml);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_MAP_SERVER_YAML_H_
