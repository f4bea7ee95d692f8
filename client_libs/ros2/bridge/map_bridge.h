// Shows one map of a server to ROS 2.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_MAP_BRIDGE_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_MAP_BRIDGE_H_

#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/executor.h"
#include "client_libs/cpp/client.h"
#include "client_libs/ros2/conversion/grids.h"
#include "client_libs/ros2/dds/dds.h"
#include "map/values/value_query.h"

namespace hypermap::ros2 {

struct MapBridgeOptions {
  std::string map;
  // Before all names; "" or "/NAME".
  std::string name_prefix;
  // The name of the node with its slash, before names of its own such as /hypermap/markers.
  std::string node = "/hypermap";
  // The layer of /map and of the masks. Empty: the first occupancy layer by name.
  std::string occupancy_layer;
  GridMode mode = GridMode::kTrinary;
  std::optional<ValueQuery> keep_out;  // the zones of /keepout_filter_mask; absent: no such topic
  std::optional<ValueQuery> speed;     // the zones of /speed_filter_mask; absent: no such topic
  // An old latched grid is sent again after this time (GridTopic).
  absl::Duration send_again_after = absl::Seconds(5);
  int64_t max_answer_items = 1'000'000;
};

// Follows the map by a replica in memory. Topics and services are there while the map is: they
// begin when the server has sent it first, and end when it is deleted. While the server is away
// they show the map as it was last.
class MapBridge {
 public:
  // `participant` must outlive the result. RESOURCE_EXHAUSTED if no thread can be started.
  static absl::StatusOr<std::unique_ptr<MapBridge>> Start(Participant* participant,
                                                          client::Client client,
                                                          MapBridgeOptions options);
  ~MapBridge();

 private:
  class Loop;
  explicit MapBridge(std::unique_ptr<Loop> loop);

  const std::unique_ptr<Loop> loop_;
  std::unique_ptr<Executor::Running> running_;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_MAP_BRIDGE_H_
