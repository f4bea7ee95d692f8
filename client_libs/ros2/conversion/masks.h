// Zones of a map as masks of nav2's costmap filters.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_MASKS_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_MASKS_H_

#include <string>

#include "absl/time/time.h"
#include "client_libs/ros2/messages/messages.h"
#include "map/layers/grid_layer.h"
#include "map/snapshot.h"
#include "map/values/value_query.h"

namespace hypermap::ros2 {

// The attribute of a speed zone: a number, metres per second.
inline constexpr char kSpeedLimitAttribute[] = "speed_limit";

// A mask, and what nav2 needs to know of it besides its topic. A value of the filter is base +
// multiplier * byte.
struct Mask {
  nav_msgs::OccupancyGrid grid;
  nav2_msgs::CostmapFilterInfo info;
};

// The cells of `like` whose centres are in a polygon that has the value, in any semantic layer:
// 100, the others 0.
Mask KeepOutMask(const Snapshot& snapshot, const GridLayer& like, const ValueQuery& value,
                 absl::Time stamp);

// The same for polygons with kSpeedLimitAttribute: 1 to 100 hundredths of the highest limit,
// rounded down but at least 1; the lowest where zones overlap; 0 where there is no limit.
Mask SpeedMask(const Snapshot& snapshot, const GridLayer& like, const ValueQuery& value,
               absl::Time stamp);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_MASKS_H_
