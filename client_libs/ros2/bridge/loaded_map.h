// Maps of the server by their addresses.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_LOADED_MAP_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_LOADED_MAP_H_

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "client_libs/cpp/client.h"
#include "client_libs/ros2/conversion/grids.h"
#include "client_libs/ros2/messages/messages.h"
#include "map/snapshot.h"

namespace hypermap::ros2 {

// hypermap://MAP/LAYER or hypermap://MAP/LAYER@REVISION.
struct MapAddress {
  std::string map;
  std::string layer;
  std::optional<Revision> revision;  // absent: the newest

  friend bool operator==(const MapAddress&, const MapAddress&) = default;
};

// INVALID_ARGUMENT if it is no such address.
absl::StatusOr<MapAddress> ParseMapAddress(absl::string_view address);

// Asks the server for an occupancy layer, at the newest revision or a past one. The result tells
// what is wrong as nav2's map_server does: no such map, layer or revision; a layer that is no
// occupancy grid; any other error.
nav2_msgs::LoadMap::Response LoadMapFrom(client::Client& client, const std::string& address,
                                         GridMode mode);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_LOADED_MAP_H_
