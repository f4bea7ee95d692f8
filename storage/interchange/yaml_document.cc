#include "storage/interchange/yaml_document.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "storage/interchange/number_text.h"

namespace hypermap::storage {
namespace {

absl::Status Wrong(const char* key, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(key, " ", what));
}

std::optional<double> NumberOf(const YAML::Node& node) {
  return node.IsScalar() ? ParseNumber(node.Scalar()) : std::nullopt;
}

}  // namespace

absl::StatusOr<YAML::Node> ParseYaml(absl::string_view text) {
  // Each of these characters may begin a node, of which yaml-cpp keeps about 400 bytes.
  constexpr int64_t kBytesOfNode = 400;
  const auto nodes = std::count_if(text.begin(), text.end(), [](char c) {
    return absl::string_view(",[{:-?\n").find(c) != absl::string_view::npos;
  });
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesOfNode * nodes));
  if (text.size() > FixedLimits::kMaxYamlBytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("YAML of ", text.size(), " bytes, more than ", FixedLimits::kMaxYamlBytes));
  }
  try {
    return YAML::Load(std::string(text));
  } catch (const YAML::Exception& e) {
    return absl::InvalidArgumentError(absl::StrCat("no YAML: ", e.what()));
  }
}

YAML::Node Value(const YAML::Node& map, const char* key) {
  const YAML::Node undefined(YAML::NodeType::Undefined);
  if (!map.IsMap()) return undefined;
  const YAML::Node value = map[key];
  return value.IsDefined() && !value.IsNull() ? value : undefined;
}

absl::StatusOr<std::string> ReadText(const YAML::Node& map, const char* key) {
  const YAML::Node value = Value(map, key);
  if (!value.IsDefined()) return Wrong(key, "is missing");
  if (!value.IsScalar()) return Wrong(key, "is not a string");
  return value.Scalar();
}

absl::StatusOr<double> ReadNumber(const YAML::Node& map, const char* key) {
  const YAML::Node value = Value(map, key);
  if (!value.IsDefined()) return Wrong(key, "is missing");
  const std::optional<double> number = NumberOf(value);
  if (!number) return Wrong(key, "is not a finite number");
  return *number;
}

absl::StatusOr<bool> ReadFlag(const YAML::Node& map, const char* key) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string text, ReadText(map, key));
  const std::string word = absl::AsciiStrToLower(text);
  for (const char* yes : {"true", "yes", "on", "y", "1"}) {
    if (word == yes) return true;
  }
  for (const char* no : {"false", "no", "off", "n", "0"}) {
    if (word == no) return false;
  }
  return Wrong(key, "is neither true nor false");
}

absl::StatusOr<YamlPose> ReadPose(const YAML::Node& map, const char* key) {
  const YAML::Node list = Value(map, key);
  if (!list.IsDefined()) return Wrong(key, "is missing");
  if (!list.IsSequence() || list.size() != 3) return Wrong(key, "is not a list [x, y, yaw]");
  std::array<double, 3> numbers{};
  for (size_t i = 0; i < numbers.size(); ++i) {
    const std::optional<double> number = NumberOf(list[i]);
    if (!number) return Wrong(key, absl::StrCat("[", i, "] is not a finite number"));
    numbers[i] = *number;
  }
  return YamlPose{numbers[0], numbers[1], numbers[2]};
}

std::string QuoteYaml(const std::string& text) {
  YAML::Emitter emitter;
  emitter << text;
  return emitter.c_str();
}

std::string QuoteYamlList(const std::vector<std::string>& texts) {
  YAML::Emitter emitter;
  emitter << YAML::Flow << texts;
  return emitter.c_str();
}

}  // namespace hypermap::storage
