// Labels of the classes of a detector.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_LABELS_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_LABELS_H_

#include <map>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::ros2 {

// By the text of a class id, or the number of a class in label images.
using Labels = std::map<std::string, std::string, std::less<>>;

// Reads lines such as "56: chair" of a flat YAML file: ids and labels may stand in quotes, without
// escapes, and "#" begins a comment. INVALID_ARGUMENT with the number of the line, for all else.
absl::StatusOr<Labels> ParseLabels(absl::string_view text);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_LABELS_H_
