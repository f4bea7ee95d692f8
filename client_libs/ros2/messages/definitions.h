// The definitions of messages as text (.msg files), for files that carry them beside their
// messages.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_MESSAGES_DEFINITIONS_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_MESSAGES_DEFINITIONS_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"

namespace hypermap::ros2 {

// A .msg file.
struct DefinitionText {
  absl::string_view type;  // such as "nav_msgs/OccupancyGrid"
  absl::string_view text;
};

// All definitions, in no particular order.
absl::Span<const DefinitionText> DefinitionTexts();

// The name of a type as ROS writes it, "nav_msgs/msg/OccupancyGrid" for the wire's
// "nav_msgs::msg::dds_::OccupancyGrid_" (kType in messages.h).
std::string RosTypeName(absl::string_view wire_type);

// The definition of a message, then those of all messages that it contains, each after a line of 80
// "=" and a line such as "MSG: std_msgs/Header": the schema encoding "ros2msg" of MCAP. `type` is
// named as in ROS. NOT_FOUND naming a type that has no definition.
absl::StatusOr<std::string> FullDefinition(absl::string_view type);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_MESSAGES_DEFINITIONS_H_
