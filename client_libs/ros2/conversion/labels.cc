#include "client_libs/ros2/conversion/labels.h"

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "base/text/utf8.h"

namespace hypermap::ros2 {
namespace {

// Removes a scalar from the beginning of `line`: quoted, or up to ": " or a comment. Returns false
// if there is none, or YAML would read it otherwise than as plain text.
bool ConsumeScalar(absl::string_view* line, std::string* scalar) {
  if (absl::StartsWith(*line, "\"") || absl::StartsWith(*line, "'")) {
    const size_t end = line->find((*line)[0], 1);
    if (end == absl::string_view::npos || end == 1) return false;
    *scalar = std::string(line->substr(1, end - 1));
    line->remove_prefix(end + 1);
    return scalar->find('\\') == std::string::npos;
  }
  size_t end = 0;
  while (end < line->size() && (*line)[end] != ':' && !absl::StartsWith(line->substr(end), " #")) {
    ++end;
  }
  *scalar = std::string(absl::StripTrailingAsciiWhitespace(line->substr(0, end)));
  line->remove_prefix(end);
  constexpr absl::string_view kSpecial = " \t#&*!|>%@`{}[],?-\"'";
  return !scalar->empty() && (kSpecial.find((*scalar)[0]) == absl::string_view::npos);
}

// Returns false if the line is no "ID: LABEL".
bool ParseLine(absl::string_view line, std::string* id, std::string* label) {
  if (!ConsumeScalar(&line, id) || !absl::ConsumePrefix(&line, ":") || line.empty() ||
      !absl::ascii_isspace(static_cast<unsigned char>(line[0]))) {
    return false;
  }
  line = absl::StripLeadingAsciiWhitespace(line);
  if (!ConsumeScalar(&line, label)) return false;
  const absl::string_view rest = absl::StripLeadingAsciiWhitespace(line);
  return rest.empty() || (rest[0] == '#' && rest.size() < line.size());
}

}  // namespace

absl::StatusOr<Labels> ParseLabels(absl::string_view text) {
  Labels labels;
  int number = 0;
  for (const absl::string_view line : absl::StrSplit(text, '\n')) {
    ++number;
    const absl::string_view content = absl::StripTrailingAsciiWhitespace(line);
    if (content.empty() || absl::StripLeadingAsciiWhitespace(content)[0] == '#') continue;
    std::string id;
    std::string label;
    if (!IsUtf8(content) || !ParseLine(content, &id, &label)) {
      return absl::InvalidArgumentError(
          absl::StrCat("line ", number, ": not an id and a label, such as \"56: chair\""));
    }
    if (!labels.emplace(id, label).second) {
      return absl::InvalidArgumentError(absl::StrCat("line ", number, ": ", id, " stands twice"));
    }
  }
  return labels;
}

}  // namespace hypermap::ros2
