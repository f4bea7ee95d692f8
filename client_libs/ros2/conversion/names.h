// Which topics show the layers of a map.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_NAMES_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_NAMES_H_

#include <memory>
#include <string>

#include "map/layers/grid_layer.h"
#include "map/snapshot.h"

namespace hypermap::ros2 {

// A name of a map or layer as part of a name of ROS: other characters than letters, digits and "_"
// become "_", and one that begins with a digit gets a "_" before it.
std::string NameInRos(const std::string& text);

// The topics of a grid layer and of a semantic layer, below the name of the node.
std::string GridTopicOf(const std::string& layer);
std::string SemanticTopicOf(const std::string& layer);

// The occupancy layer of /map: the one called `name`, or the first one if that is empty; null if
// there is none.
std::shared_ptr<const GridLayer> OccupancyLayerOf(const Snapshot& snapshot,
                                                  const std::string& name);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_NAMES_H_
