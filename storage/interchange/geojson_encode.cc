#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "map/layers/semantic_layer.h"
#include "nlohmann/json.hpp"
#include "storage/interchange/geojson.h"
#include "storage/interchange/geojson_properties.h"

namespace hypermap::storage {
namespace {

using nlohmann::ordered_json;

std::string ToText(const ordered_json& value) {
  return value.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

ordered_json Position(const Point& p) { return ordered_json::array({p.x, p.y}); }

ordered_json Positions(const std::vector<Point>& points) {
  ordered_json positions = ordered_json::array();
  for (const Point& p : points) positions.push_back(Position(p));
  return positions;
}

ordered_json EncodeGeometry(const Polygon& polygon) {
  ordered_json rings = ordered_json::array();
  for (const Ring& ring : polygon.rings()) {
    rings.push_back(Positions(ring));
    rings.back().push_back(Position(ring.front()));
  }
  return {{"type", "Polygon"}, {"coordinates", std::move(rings)}};
}

ordered_json EncodeGeometry(const LineString& line) {
  return {{"type", "LineString"}, {"coordinates", Positions(line.vertices())}};
}

ordered_json EncodeGeometry(const Point& point) {
  return {{"type", "Point"}, {"coordinates", Position(point)}};
}

// Appends the layer's objects to the list of features that `text` ends with, a line each, and what
// the format can't carry to `omissions`. Errors of CheckCancelled and TakeMemory.
absl::Status AddLayer(const Snapshot& snapshot, const Layer& layer, std::string& text,
                      std::vector<std::string>& omissions) {
  const std::string& name = layer.spec().name;
  const auto* semantic = AsSemantic(&layer);
  if (!semantic) {
    omissions.push_back(absl::StrCat("layer \"", name, "\": GeoJSON carries no cells"));
    return absl::OkStatus();
  }
  const auto map_from_layer = snapshot.frames.Lookup(snapshot.frame_id, layer.spec().frame_id);
  if (!map_from_layer.ok()) {
    omissions.push_back(absl::StrCat("layer \"", name, "\": ", map_from_layer.status().message()));
    return absl::OkStatus();
  }
  std::vector<std::string> lost;
  for (const ObjectPtr& object : semantic->Objects()) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const Shape shape = *map_from_layer * object->shape;
    const ordered_json feature = {
        {"type", "Feature"},
        {"id", object->id},
        {"layer", name},
        {"properties", EncodeProperties(*object, lost)},
        {"geometry", shape.Visit([](const auto& geometry) { return EncodeGeometry(geometry); })}};
    const std::string line = ToText(feature);
    // A string that grows takes up to twice its length.
    HYPERMAP_RETURN_IF_ERROR(TakeMemory(2 * static_cast<int64_t>(line.size())));
    const bool is_first = text.back() == '\n';
    absl::StrAppend(&text, is_first ? "" : ",\n", line);
  }
  if (!lost.empty()) {
    const std::set<std::string> names(lost.begin(), lost.end());
    omissions.push_back(absl::StrCat("layer \"", name, "\": attributes named as other properties: ",
                                     absl::StrJoin(names, ", ")));
  }
  if (const size_t aliases = layer.spec().aliases.size(); aliases > 0) {
    omissions.push_back(absl::StrCat("layer \"", name, "\": ", aliases, " aliases"));
  }
  if (!layer.spec().shape_kinds.ContainsAll()) {
    omissions.push_back(absl::StrCat("layer \"", name, "\": which kinds of shape it takes"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ExportedFiles> EncodeGeoJson(const Snapshot& snapshot,
                                            const std::vector<std::string>& layers) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<LayerPtr> selected, snapshot.SelectLayers(layers));
  // A null crs says that the positions are in no reference system that a reader could know. Each
  // feature has a line of its own, so that files can be compared and searched by line.
  std::string text =
      absl::StrCat("{\"type\":\"FeatureCollection\",\"frame\":", ToText(snapshot.frame_id),
                   ",\"crs\":null,\"features\":[\n");
  ExportedFiles exported;
  for (const LayerPtr& layer : selected) {
    HYPERMAP_RETURN_IF_ERROR(AddLayer(snapshot, *layer, text, exported.omissions));
  }
  absl::StrAppend(&text, "\n]}\n");
  exported.files.push_back({absl::StrCat(snapshot.map_name, ".geojson"), std::move(text)});
  return exported;
}

}  // namespace hypermap::storage
