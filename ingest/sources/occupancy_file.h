// Reads the occupancy map in which a robot localises itself, from nav2's files.
#ifndef HYPERMAP_INGEST_SOURCES_OCCUPANCY_FILE_H_
#define HYPERMAP_INGEST_SOURCES_OCCUPANCY_FILE_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "map/layers/grid_layer.h"

namespace hypermap::ingest {

// Reads the YAML file of map_server or nav2, and the image that it names. Errors name the file.
absl::StatusOr<std::shared_ptr<const GridLayer>> ReadOccupancy(const std::string& yaml_path);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_OCCUPANCY_FILE_H_
