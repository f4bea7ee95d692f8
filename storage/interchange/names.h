// Words and names found in files, made fit for the domain's rules (map/layers/layer_spec.h,
// map/layers/semantic_object.h). Each function gives back what it is given when that is fit
// already.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_NAMES_H_
#define HYPERMAP_STORAGE_INTERCHANGE_NAMES_H_

#include <string>

#include "absl/strings/string_view.h"

namespace hypermap::storage {

// For labels and tags: control characters become blanks, blanks at the ends go and runs of them
// become one, bytes that are no UTF-8 become U+FFFD. May be empty.
std::string CleanWord(absl::string_view text);

// For layers. Never empty.
std::string SanitizeName(absl::string_view text);

// For frames: without the leading '/' that ROS 1 writes. May be empty.
std::string SanitizeFrameId(absl::string_view text);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_NAMES_H_
