// Changes words and names found in files so that they follow the domain's rules
// (map/layers/layer_spec.h, map/objects/semantic_object.h). Text that follows them already is
// returned unchanged.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_NAMES_H_
#define HYPERMAP_STORAGE_INTERCHANGE_NAMES_H_

#include <cstddef>
#include <string>

#include "absl/strings/string_view.h"

namespace hypermap::storage {

// For labels and tags: control characters become blanks, blanks at the ends are removed and runs of
// blanks become one; bytes that are not UTF-8 become U+FFFD. The result may be empty.
std::string CleanWord(absl::string_view text);

// Returns `text`, or as much of its beginning as fits into `max_bytes`, whole UTF-8 characters with
// "..." behind them. REQUIRES: max_bytes >= 3.
std::string CutText(absl::string_view text, size_t max_bytes);

// For layers. The result is never empty.
std::string SanitizeName(absl::string_view text);

// For frames: also removes the leading '/' that ROS 1 writes. The result may be empty.
std::string SanitizeFrameId(absl::string_view text);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_NAMES_H_
