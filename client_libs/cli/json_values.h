// Converts parts of answers to JSON.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_JSON_VALUES_H_
#define HYPERMAP_CLIENT_LIBS_CLI_JSON_VALUES_H_

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "client_libs/cpp/answers.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/point.h"
#include "map/geometry/polygon.h"
#include "map/geometry/shape.h"
#include "map/grid/grid_geometry.h"
#include "map/layers/layer_spec.h"
#include "map/objects/semantic_object.h"

namespace hypermap::cli {

// Keeps members in the order in which they are documented.
using Json = nlohmann::ordered_json;

std::string Text(absl::string_view text);
Json PointJson(const Point& p);
// The rings of the polygon, each closed, as in GeoJSON.
Json PolygonJson(const Polygon& polygon);
// RFC 3339, UTC.
Json TimeJson(absl::Time time);
// The object without its version, which may differ between equal objects of two maps. The
// coordinates are in the member "polygon" (rings), "line_string" (points) or "point".
Json EntityJson(const SemanticObject& object);
Json PoseJson(const PlanarTransform& pose);
Json GridJson(const GridGeometry& grid);
// 0 or 1 if `is_binary` (see LayerProperties), otherwise the number; null if unknown.
Json CellValueJson(bool is_binary, const std::optional<double>& value);
// [row, col_begin, col_end, value].
Json RunJson(bool is_binary, const CellRun& run);
Json TransformJson(const FrameTransform& transform);
Json LayerJson(const client::LayerEntry& layer);
// A change without its revision and time: "layer", "op", and the members of that op.
Json ChangeJson(const client::MapChange& change);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_JSON_VALUES_H_
