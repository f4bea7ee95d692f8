// Checks the vertices of all kinds of shapes.
#ifndef HYPERMAP_MAP_GEOMETRY_COORDINATES_H_
#define HYPERMAP_MAP_GEOMETRY_COORDINATES_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "map/geometry/point.h"

namespace hypermap {

// Larger than any site; products of much larger coordinates might exceed the range of doubles.
inline constexpr double kMaxCoordinate_m = 1e9;

// Returns INVALID_ARGUMENT naming the first vertex that is not finite, or that is more than
// kMaxCoordinate_m from the origin along an axis: "outer[3]" for the name "outer".
absl::Status CheckVertices(absl::string_view name, absl::Span<const Point> vertices);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_COORDINATES_H_
