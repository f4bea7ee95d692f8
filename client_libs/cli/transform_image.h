// A picture of a map that is laid over another one.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_TRANSFORM_IMAGE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_TRANSFORM_IMAGE_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_libs/cli/canvas.h"
#include "client_libs/cli/map_image.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/point.h"
#include "map/geometry/shape.h"
#include "map/grid/grid_geometry.h"
#include "map/layers/layer.h"

namespace hypermap::cli {

// The colours of the two maps.
inline constexpr Colour kSourceColour{0.9, 0.2, 0.0};
inline constexpr Colour kTargetColour = Grey(0.45);

// The content of one side, in its own frame: the cells of a grid, or the shapes of objects.
struct TransformSideScene {
  std::string name;
  std::optional<GridGeometry> grid;
  std::vector<CellRun> runs;
  std::vector<Shape> shapes;
};

// The same place on both sides, each in its own frame.
struct TransformPairScene {
  Point source;
  Point target;
  bool agrees = false;
};

struct TransformScene {
  TransformSideScene source;  // of a grid only the occupied cells
  TransformSideScene target;
  std::vector<TransformPairScene> pairs;
  PlanarTransform target_from_source;
  std::vector<std::string> notes;  // lines of the legend
};

// Draws the target in grey, and over it the walls, or the outlines of the objects, of the source in
// a colour. A cross is a point of the source, a disc one of the target; a broken line leads from
// one to the other if they do not agree. There is a scale and a legend. North (y) of the target is
// up. FAILED_PRECONDITION if there is nothing to draw.
absl::StatusOr<MapImage> DrawTransform(const TransformScene& scene);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_TRANSFORM_IMAGE_H_
