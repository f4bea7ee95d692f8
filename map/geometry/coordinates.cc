#include "map/geometry/coordinates.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace hypermap {

absl::Status CheckVertices(absl::string_view name, absl::Span<const Point> vertices) {
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Point& p = vertices[i];
    if (!IsFinite(p)) {
      return absl::InvalidArgumentError(absl::StrCat(name, "[", i, "] is not finite"));
    }
    if (std::max(std::abs(p.x), std::abs(p.y)) > kMaxCoordinate_m) {
      return absl::InvalidArgumentError(
          absl::StrCat(name, "[", i, "] is more than ", kMaxCoordinate_m, " m from the origin"));
    }
  }
  return absl::OkStatus();
}

}  // namespace hypermap
