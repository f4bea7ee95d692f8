#include "client_libs/cli/point_pairs_file.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client_libs/cli/coordinates.h"

namespace hypermap::cli {
namespace {

constexpr size_t kFields = 5;

std::optional<client::NamedPair> PairOf(const std::vector<absl::string_view>& fields) {
  if (fields.size() != kFields && fields.size() != kFields + 1) return std::nullopt;
  std::vector<double> numbers;
  for (size_t i = 1; i < fields.size(); ++i) {
    const absl::StatusOr<double> number = ParseNumber(absl::StripAsciiWhitespace(fields[i]));
    if (!number.ok()) return std::nullopt;
    numbers.push_back(*number);
  }
  client::NamedPair pair;
  pair.name = std::string(absl::StripAsciiWhitespace(fields[0]));
  pair.pair.source = {numbers[0], numbers[1]};
  pair.pair.target = {numbers[2], numbers[3]};
  if (numbers.size() == kFields) pair.pair.sigma_m = numbers[4];
  return pair;
}

}  // namespace

absl::StatusOr<std::vector<client::NamedPair>> ReadPointPairs(absl::string_view text) {
  std::vector<client::NamedPair> pairs;
  int64_t number = 0;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    ++number;
    line = absl::StripAsciiWhitespace(line);
    if (line.empty() || (number == 1 && absl::StartsWithIgnoreCase(line, "name,"))) continue;
    std::optional<client::NamedPair> pair = PairOf(absl::StrSplit(line, ','));
    if (!pair) {
      return absl::InvalidArgumentError(
          absl::StrCat("line ", number, ": \"", line,
                       "\" is not of the form NAME,SOURCE_X,SOURCE_Y,TARGET_X,TARGET_Y[,SIGMA]"));
    }
    pairs.push_back(*std::move(pair));
  }
  return pairs;
}

}  // namespace hypermap::cli
