#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "map/layers/semantic_layer.h"
#include "nlohmann/json.hpp"
#include "storage/interchange/geojson.h"
#include "storage/interchange/geojson_properties.h"

namespace hypermap::storage {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

std::string ToText(const ordered_json& value) {
  return value.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

json EncodeRings(const Polygon& polygon) {
  json rings = json::array();
  for (const Ring& ring : polygon.rings()) {
    json positions = json::array();
    for (const Point& p : ring) positions.push_back({p.x, p.y});
    positions.push_back({ring.front().x, ring.front().y});
    rings.push_back(std::move(positions));
  }
  return rings;
}

// Adds the layer's objects to `features`, one text each, or says why not.
void AddLayer(const Snapshot& snapshot, const Layer& layer, std::vector<std::string>& features,
              std::vector<std::string>& omissions) {
  const std::string& name = layer.spec().name;
  const auto* semantic = dynamic_cast<const SemanticLayer*>(&layer);
  if (!semantic) {
    omissions.push_back(absl::StrCat("layer \"", name, "\": GeoJSON carries no cells"));
    return;
  }
  const auto map_from_layer = snapshot.frames.Lookup(snapshot.frame_id, layer.spec().frame_id);
  if (!map_from_layer.ok()) {
    omissions.push_back(absl::StrCat("layer \"", name, "\": ", map_from_layer.status().message()));
    return;
  }
  std::vector<std::string> lost;
  for (const ObjectPtr& object : semantic->Objects()) {
    const ordered_json feature = {
        {"type", "Feature"},
        {"id", object->id},
        {"layer", name},
        {"properties", EncodeProperties(*object, lost)},
        {"geometry",
         {{"type", "Polygon"}, {"coordinates", EncodeRings(*map_from_layer * object->polygon)}}}};
    features.push_back(ToText(feature));
  }
  if (!lost.empty()) {
    const std::set<std::string> names(lost.begin(), lost.end());
    omissions.push_back(absl::StrCat("layer \"", name, "\": attributes named as other properties: ",
                                     absl::StrJoin(names, ", ")));
  }
  if (const size_t aliases = layer.spec().aliases.size(); aliases > 0) {
    omissions.push_back(absl::StrCat("layer \"", name, "\": ", aliases, " aliases"));
  }
}

}  // namespace

absl::StatusOr<ExportedFiles> EncodeGeoJson(const Snapshot& snapshot,
                                            const std::vector<std::string>& layers) {
  absl::StatusOr<std::vector<LayerPtr>> selected = snapshot.SelectLayers(layers);
  if (!selected.ok()) return selected.status();
  ExportedFiles exported;
  std::vector<std::string> features;
  for (const LayerPtr& layer : *selected) {
    AddLayer(snapshot, *layer, features, exported.omissions);
  }
  // A null crs says that positions are in no reference system that a reader could know. A feature a
  // line, so that files can be compared and searched by line.
  exported.files.push_back(
      {absl::StrCat(snapshot.map_name, ".geojson"),
       absl::StrCat("{\"type\":\"FeatureCollection\",\"frame\":", ToText(snapshot.frame_id),
                    ",\"crs\":null,\"features\":[\n", absl::StrJoin(features, ",\n"), "\n]}\n")});
  return exported;
}

}  // namespace hypermap::storage
