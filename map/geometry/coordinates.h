// The check that vertices of every kind of shape pass.
#ifndef HYPERMAP_MAP_GEOMETRY_COORDINATES_H_
#define HYPERMAP_MAP_GEOMETRY_COORDINATES_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "map/geometry/point.h"

namespace hypermap {

// No site reaches farther, and products of larger coordinates might leave the range of doubles.
inline constexpr double kMaxCoordinate_m = 1e9;

// INVALID_ARGUMENT naming the first vertex ("outer[3]" for the name "outer") that is not finite or
// is more than kMaxCoordinate_m from the origin along an axis.
absl::Status CheckVertices(absl::string_view name, absl::Span<const Point> vertices);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_COORDINATES_H_
