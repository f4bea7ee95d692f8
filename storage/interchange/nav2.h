// The map format of ROS: map_server or nav2_map_server YAML with a PGM or PNG image.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_NAV2_H_
#define HYPERMAP_STORAGE_INTERCHANGE_NAV2_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "base/limits/limits.h"
#include "map/snapshot.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::storage {

// Decodes one .yaml or .yml file and the image that it names (by its base name) to edits that
// create the occupancy layer `layer` in the frame `frame_id` (empty: the map's own).
// INVALID_ARGUMENT naming the place; RESOURCE_EXHAUSTED naming the limit.
absl::StatusOr<ImportedMap> DecodeNav2(const std::vector<NamedFile>& files,
                                       const std::string& layer, const std::string& frame_id,
                                       const Limits& limits);

enum class Nav2Image { kPgm, kPng };

// Encodes a layer as `<layer>.yaml` and its image. NOT_FOUND; FAILED_PRECONDITION when the layer is
// not an occupancy grid.
absl::StatusOr<ExportedFiles> EncodeNav2(const Snapshot& snapshot, const std::string& layer,
                                         Nav2Image image);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_NAV2_H_
