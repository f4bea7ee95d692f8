// Small YAML documents as trees of nodes. The functions catch the exceptions of yaml-cpp.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_YAML_DOCUMENT_H_
#define HYPERMAP_STORAGE_INTERCHANGE_YAML_DOCUMENT_H_

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::storage {

// Parses the first document. INVALID_ARGUMENT naming the line when it is not YAML or has aliases,
// with which a small text becomes a huge tree; RESOURCE_EXHAUSTED when it is larger than
// FixedLimits::kMaxYamlBytes or its memory is refused.
absl::StatusOr<YAML::Node> ParseYaml(absl::string_view text);

// The error of a text that yaml-cpp has refused.
absl::Status NoYaml(const YAML::Exception& exception);

// Keys of a map whose values are read. Each look-up takes time with their number.
inline constexpr size_t kMaxKeys = 256;

// Returns OK if `node` is a map of at most kMaxKeys keys; otherwise INVALID_ARGUMENT, which calls
// it `name`.
absl::Status CheckMap(const YAML::Node& node, absl::string_view name);

// The value of a key of a map; an undefined node when it is absent or null.
YAML::Node Value(const YAML::Node& map, const char* key);

// The value of a key, converted to a type. INVALID_ARGUMENT naming the key.
absl::StatusOr<std::string> ReadText(const YAML::Node& map, const char* key);
absl::StatusOr<double> ReadNumber(const YAML::Node& map, const char* key);
// Accepts true, yes, on, 1 and their opposites.
absl::StatusOr<bool> ReadFlag(const YAML::Node& map, const char* key);
// A list [x, y, yaw] of finite numbers.
struct YamlPose {
  double x = 0.0;
  double y = 0.0;
  double yaw = 0.0;
};
absl::StatusOr<YamlPose> ReadPose(const YAML::Node& map, const char* key);

// Formats a string as a scalar, quoted where it would not be read back as the same string.
std::string QuoteYaml(const std::string& text);
// Formats strings as a list, "[a, b]".
std::string QuoteYamlList(const std::vector<std::string>& texts);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_YAML_DOCUMENT_H_
