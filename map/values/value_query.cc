#include "map/values/value_query.h"

#include <cmath>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"

namespace hypermap {
namespace {

constexpr absl::string_view kTagPrefix = "tag:";
constexpr absl::string_view kRangeSign = "..";

std::optional<ValueKeyword> ParseKeyword(absl::string_view folded) {
  if (folded == "free") return ValueKeyword::kFree;
  if (folded == "occupied") return ValueKeyword::kOccupied;
  if (folded == "unknown") return ValueKeyword::kUnknown;
  if (folded == "explored") return ValueKeyword::kExplored;
  if (folded == "unexplored") return ValueKeyword::kUnexplored;
  return std::nullopt;
}

absl::Status Refusal(absl::string_view text, absl::string_view reason) {
  return absl::InvalidArgumentError(absl::StrCat("value '", text, "': ", reason));
}

// `text` is folded and begins with a comparison sign.
absl::StatusOr<ValueQuery> ParseComparison(absl::string_view text) {
  const char sign = text.front();
  absl::string_view number = text.substr(1);
  const bool or_equal = sign != '=' && absl::ConsumePrefix(&number, "=");
  double v = 0.0;
  if (!absl::SimpleAtod(number, &v) || !std::isfinite(v)) {
    return Refusal(text, "a comparison needs a finite number");
  }
  ValueRange range;
  if (sign != '<') {
    range.low = v;
    range.low_open = sign == '>' && !or_equal;
  }
  if (sign != '>') {
    range.high = v;
    range.high_open = sign == '<' && !or_equal;
  }
  return range;
}

// Returns nullopt if neither side of ".." is a number: then the text is a label that contains dots.
std::optional<absl::StatusOr<ValueQuery>> ParseRange(absl::string_view text) {
  const size_t sign = text.find(kRangeSign);
  if (sign == absl::string_view::npos) return std::nullopt;
  const absl::string_view low_text = text.substr(0, sign);
  const absl::string_view high_text = text.substr(sign + kRangeSign.size());
  ValueRange range;
  const bool has_low = absl::SimpleAtod(low_text, &range.low);
  const bool has_high = absl::SimpleAtod(high_text, &range.high);
  if (!has_low && !has_high && !(low_text.empty() && high_text.empty())) return std::nullopt;
  if (!has_low || !has_high || !std::isfinite(range.low) || !std::isfinite(range.high)) {
    return Refusal(text, "a range needs two finite numbers");
  }
  if (range.low > range.high) return Refusal(text, "the range ends before it begins");
  return range;
}

}  // namespace

absl::StatusOr<ValueQuery> ParseValueQuery(absl::string_view text) {
  const std::string folded = FoldLabel(text);
  if (folded.empty()) return absl::InvalidArgumentError("value must not be empty");
  if (const auto keyword = ParseKeyword(folded)) return *keyword;
  if (folded[0] == '>' || folded[0] == '<' || folded[0] == '=') return ParseComparison(folded);
  if (absl::StartsWith(folded, kTagPrefix)) {
    std::string tag = FoldLabel(absl::string_view(folded).substr(kTagPrefix.size()));
    if (tag.empty()) return Refusal(folded, "the tag must not be empty");
    return ValueTag{std::move(tag)};
  }
  if (auto range = ParseRange(folded)) return *range;
  return ValueLabel{folded};
}

std::string FoldLabel(absl::string_view label) {
  std::string folded;
  folded.reserve(label.size());
  for (const char c : absl::StripAsciiWhitespace(label)) {
    if (!absl::ascii_isspace(c)) {
      folded.push_back(absl::ascii_tolower(c));
    } else if (folded.back() != ' ') {
      folded.push_back(' ');
    }
  }
  return folded;
}

}  // namespace hypermap
