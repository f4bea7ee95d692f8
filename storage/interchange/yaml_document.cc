#include "storage/interchange/yaml_document.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <istream>
#include <optional>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "storage/interchange/names.h"
#include "storage/interchange/number_text.h"
#include "storage/interchange/yaml_input.h"

namespace hypermap::storage {
namespace {

absl::Status Wrong(const char* key, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(key, " ", what));
}

std::optional<double> NumberOf(const YAML::Node& node) {
  return node.IsScalar() ? ParseNumber(node.Scalar()) : std::nullopt;
}

// Ends the parser at the first alias, with an exception.
class AliasRefuser final : public YAML::EventHandler {
 public:
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override {
    throw YAML::ParserException(mark, "aliases are not read");
  }
  void OnDocumentStart(const YAML::Mark& /*mark*/) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& /*mark*/, YAML::anchor_t /*anchor*/) override {}
  void OnScalar(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                const std::string& /*value*/) override {}
  void OnSequenceStart(const YAML::Mark& /*mark*/, const std::string& /*tag*/,
                       YAML::anchor_t /*anchor*/, YAML::EmitterStyle::value /*style*/) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                  YAML::EmitterStyle::value /*style*/) override {}
  void OnMapEnd() override {}
};

absl::Status RunParser(absl::string_view text, absl::FunctionRef<void(std::istream&)> parse) {
  YamlInput input(text);
  std::istream stream(&input);
  absl::Status status;
  try {
    parse(stream);
  } catch (const YAML::Exception& e) {
    status = NoYaml(e);
  }
  // A text that ended early may look right or wrong.
  HYPERMAP_RETURN_IF_ERROR(input.status());
  return status;
}

}  // namespace

absl::StatusOr<YAML::Node> ParseYaml(absl::string_view text) {
  if (text.size() > FixedLimits::kMaxYamlBytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("YAML of ", text.size(), " bytes, more than ", FixedLimits::kMaxYamlBytes));
  }
  HYPERMAP_RETURN_IF_ERROR(RunParser(text, [](std::istream& stream) {
    AliasRefuser refuser;
    YAML::Parser(stream).HandleNextDocument(refuser);
  }));
  // Each of these characters may begin a node, of which yaml-cpp keeps about 400 bytes.
  constexpr int64_t kBytesOfNode = 400;
  const auto nodes = std::count_if(text.begin(), text.end(), [](char c) {
    return absl::string_view(",[{:-?\n").find(c) != absl::string_view::npos;
  });
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesOfNode * nodes));
  YAML::Node root;
  HYPERMAP_RETURN_IF_ERROR(
      RunParser(text, [&root](std::istream& stream) { root.reset(YAML::Load(stream)); }));
  return root;
}

absl::Status NoYaml(const YAML::Exception& exception) {
  constexpr size_t kMaxBytes = 300;  // It may contain a word of the text.
  return absl::InvalidArgumentError(
      absl::StrCat("no YAML: ", CutText(exception.what(), kMaxBytes)));
}

absl::Status CheckMap(const YAML::Node& node, absl::string_view name) {
  if (!node.IsMap()) {
    return absl::InvalidArgumentError(absl::StrCat(name, " is not a map of keys"));
  }
  if (node.size() <= kMaxKeys) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(name, " has more than ", kMaxKeys, " keys"));
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
