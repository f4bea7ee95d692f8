#include "client_libs/cli/point_lines.h"

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client_libs/cli/coordinates.h"

namespace hypermap::cli {
namespace {

bool IsSeparator(char c) { return c == ',' || c == ';' || absl::ascii_isspace(c); }

std::vector<absl::string_view> FieldsOf(absl::string_view line) {
  std::vector<absl::string_view> fields;
  for (size_t begin = 0; begin < line.size();) {
    if (IsSeparator(line[begin])) {
      ++begin;
      continue;
    }
    size_t end = begin;
    while (end < line.size() && !IsSeparator(line[end])) ++end;
    fields.push_back(line.substr(begin, end - begin));
    begin = end;
  }
  return fields;
}

std::optional<Point> PointOf(const std::vector<absl::string_view>& fields) {
  if (fields.size() != 2) return std::nullopt;
  const absl::StatusOr<double> x = ParseNumber(fields[0]);
  const absl::StatusOr<double> y = ParseNumber(fields[1]);
  if (!x.ok() || !y.ok()) return std::nullopt;
  return Point{*x, *y};
}

bool IsHeader(const std::vector<absl::string_view>& fields) {
  return fields.size() == 2 && absl::EqualsIgnoreCase(fields[0], "x") &&
         absl::EqualsIgnoreCase(fields[1], "y");
}

}  // namespace

std::vector<Point> PointLines::Next(size_t max_points) {
  std::vector<Point> points;
  std::string line;
  while (status_.ok() && points.size() < max_points && (points.empty() || !paused()) &&
         std::getline(in_, line)) {
    ++line_number_;
    const std::vector<absl::string_view> fields = FieldsOf(line);
    if (fields.empty() || (line_number_ == 1 && IsHeader(fields))) continue;
    if (const std::optional<Point> point = PointOf(fields)) {
      points.push_back(*point);
    } else {
      status_ = absl::InvalidArgumentError(
          absl::StrCat("line ", line_number_, ": \"", line, "\" is not of the form X Y"));
    }
  }
  return points;
}

}  // namespace hypermap::cli
