// Coordinates on a command line.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_COORDINATES_H_
#define HYPERMAP_CLIENT_LIBS_CLI_COORDINATES_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/polygon.h"

namespace hypermap::cli {

// Returns the double nearest to the decimal number. INVALID_ARGUMENT if the text is not a finite
// number.
absl::StatusOr<double> ParseNumber(absl::string_view text);

// Parses "X,Y" in metres.
absl::StatusOr<Point> ParsePoint(absl::string_view text);

// Parses "X,Y,YAW" in metres and radians.
absl::StatusOr<PlanarTransform> ParsePose(absl::string_view text);

// Returns the polygon with these vertices ("X,Y"). INVALID_ARGUMENT as for Polygon::Make.
absl::StatusOr<Polygon> ParsePolygon(const std::vector<std::string>& vertices);

// Returns a square that contains everything on a map, in each of its frames.
Polygon Everywhere();

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_COORDINATES_H_
