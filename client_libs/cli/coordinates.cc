#include "client_libs/cli/coordinates.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status/status_macros.h"

namespace hypermap::cli {
namespace {

absl::StatusOr<std::vector<double>> ParseNumbers(absl::string_view text, absl::string_view form,
                                                 size_t count) {
  std::vector<double> numbers;
  for (absl::string_view part : absl::StrSplit(text, ',')) {
    absl::StatusOr<double> number = ParseNumber(part);
    if (!number.ok()) break;
    numbers.push_back(*number);
  }
  const size_t parts = std::count(text.begin(), text.end(), ',') + 1;
  if (numbers.size() != count || parts != count) {
    return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is not of the form ", form));
  }
  return numbers;
}

}  // namespace

absl::StatusOr<double> ParseNumber(absl::string_view text) {
  double number;
  if (!absl::SimpleAtod(text, &number) || !std::isfinite(number)) {
    return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is not a finite number"));
  }
  return number;
}

absl::StatusOr<Point> ParsePoint(absl::string_view text) {
  HYPERMAP_ASSIGN_OR_RETURN(auto numbers, ParseNumbers(text, "X,Y", 2));
  return Point{numbers[0], numbers[1]};
}

absl::StatusOr<PlanarTransform> ParsePose(absl::string_view text) {
  HYPERMAP_ASSIGN_OR_RETURN(auto numbers, ParseNumbers(text, "X,Y,YAW", 3));
  return PlanarTransform(numbers[0], numbers[1], numbers[2]);
}

absl::StatusOr<Polygon> ParsePolygon(const std::vector<std::string>& vertices) {
  Ring ring;
  for (const std::string& vertex : vertices) {
    HYPERMAP_ASSIGN_OR_RETURN(Point point, ParsePoint(vertex));
    ring.push_back(point);
  }
  return Polygon::Make(std::move(ring));
}

Polygon Everywhere() {
  // Contents of maps lie within this distance, and a rotated corner of the square is still a valid
  // coordinate.
  constexpr double kFar = 5e8;
  return Polygon::FromBox({{-kFar, -kFar}, {kFar, kFar}});
}

}  // namespace hypermap::cli
