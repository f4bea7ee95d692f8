#include "client_libs/ros2/messages/definitions.h"

#include <algorithm>
#include <iterator>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "base/status/status_macros.h"

namespace hypermap::ros2 {
namespace {

constexpr absl::string_view kPrimitives[] = {"bool",   "byte",  "char",   "float32", "float64",
                                             "int8",   "uint8", "int16",  "uint16",  "int32",
                                             "uint32", "int64", "uint64", "string"};

absl::StatusOr<absl::string_view> TextOf(absl::string_view type) {
  for (const DefinitionText& definition : DefinitionTexts()) {
    if (definition.type == type) return definition.text;
  }
  return absl::NotFoundError(absl::StrCat("there is no definition of the message ", type));
}

// The types of the fields that are messages, with their packages, in order.
std::vector<std::string> MessagesIn(absl::string_view package, absl::string_view text) {
  std::vector<std::string> types;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    line = absl::StripLeadingAsciiWhitespace(line.substr(0, line.find('#')));
    // Without the size of an array.
    const absl::string_view type = line.substr(0, line.find_first_of(" ["));
    const bool is_primitive =
        std::find(std::begin(kPrimitives), std::end(kPrimitives), type) != std::end(kPrimitives);
    if (type.empty() || is_primitive) continue;
    types.push_back(type.find('/') == absl::string_view::npos ? absl::StrCat(package, "/", type)
                                                              : std::string(type));
  }
  return types;
}

}  // namespace

std::string RosTypeName(absl::string_view wire_type) {
  return absl::StrReplaceAll(absl::StripSuffix(wire_type, "_"), {{"::dds_::", "/"}, {"::", "/"}});
}

absl::StatusOr<std::string> FullDefinition(absl::string_view type) {
  std::vector<std::string> types = {absl::StrReplaceAll(type, {{"/msg/", "/"}})};
  std::string definition;
  // Grows while it is walked through.
  for (size_t i = 0; i < types.size(); ++i) {
    HYPERMAP_ASSIGN_OR_RETURN(const absl::string_view text, TextOf(types[i]));
    if (i > 0) absl::StrAppend(&definition, std::string(80, '='), "\nMSG: ", types[i], "\n");
    absl::StrAppend(&definition, text);
    const std::string package = types[i].substr(0, types[i].find('/'));
    for (std::string& used : MessagesIn(package, text)) {
      if (std::find(types.begin(), types.end(), used) == types.end()) {
        types.push_back(std::move(used));
      }
    }
  }
  return definition;
}

}  // namespace hypermap::ros2
