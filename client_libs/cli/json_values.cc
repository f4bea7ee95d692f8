#include "client_libs/cli/json_values.h"

#include <cmath>
#include <cstdint>
#include <utility>
#include <variant>

namespace hypermap::cli {
namespace {

Json PointsJson(const std::vector<Point>& points) {
  Json json = Json::array();
  for (const Point& p : points) json.push_back(PointJson(p));
  return json;
}

// Repeats the first vertex at the end, as GeoJSON requires.
Json RingJson(const Ring& ring) {
  Json json = PointsJson(ring);
  if (!ring.empty()) json.push_back(PointJson(ring.front()));
  return json;
}

}  // namespace

std::string Text(absl::string_view text) { return std::string(text); }

Json PointJson(const Point& p) { return Json::array({p.x, p.y}); }

Json PolygonJson(const Polygon& polygon) {
  Json json = Json::array();
  for (const Ring& ring : polygon.rings()) json.push_back(RingJson(ring));
  return json;
}

Json CoordinatesJson(const Shape& shape) {
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      return PolygonJson(shape.polygon());
    case ShapeKind::kLineString:
      return PointsJson(shape.line_string().vertices());
    case ShapeKind::kPoint:
      return PointJson(shape.point());
  }
  return nullptr;
}

Json ShapeKindsJson(const ShapeKinds& kinds) {
  Json json = Json::array();
  for (const ShapeKind kind : kAllShapeKinds) {
    if (kinds.Contains(kind)) json.push_back(Text(ShapeKindName(kind)));
  }
  return json;
}

Json PropertiesJson(const LayerProperties& properties) {
  Json range;
  if (properties.value_range) {
    range = Json::array({properties.value_range->min, properties.value_range->max});
  }
  return {{"has_cells", properties.has_cells}, {"has_shapes", properties.has_shapes},
          {"unit", properties.unit},           {"value_range", std::move(range)},
          {"words", properties.words},         {"is_binary", properties.is_binary}};
}

Json TimeJson(absl::Time time) {
  return absl::FormatTime(absl::RFC3339_full, time, absl::UTCTimeZone());
}

Json EntityJson(const SemanticObject& object) {
  Json attributes = Json::object();
  for (const auto& [key, attribute] : object.attributes) {
    std::visit([&, &name = key](const auto& value) { attributes[name] = value; }, attribute);
  }
  Json classes = Json::object();
  for (const auto& [label, confidence] : object.classes) classes[label] = confidence;
  Json json = {
      {"id", object.id},
      {"label", object.label},
      {"classes", std::move(classes)},
      {"existence", object.existence},
      {Text(ShapeKindName(object.shape.kind())), CoordinatesJson(object.shape)},
      {"centroid", PointJson(Centroid(object.shape))},
      {"tags", object.tags},
      {"attributes", std::move(attributes)},
      {"height",
       object.height ? Json::array({object.height->low_m, object.height->high_m}) : Json()},
  };
  if (object.expires_at) json["expires_at"] = TimeJson(*object.expires_at);
  return json;
}

Json PoseJson(const PlanarTransform& pose) { return Json::array({pose.x(), pose.y(), pose.yaw()}); }

Json GridJson(const GridGeometry& grid) {
  return {{"origin", PoseJson(grid.layer_from_grid)}, {"resolution_m", grid.resolution_m}};
}

Json CellValueJson(bool is_binary, const std::optional<double>& value) {
  if (!value.has_value()) return nullptr;
  if (is_binary && std::trunc(*value) == *value) return static_cast<int64_t>(*value);
  return *value;
}

Json RunJson(bool is_binary, const CellRun& run) {
  return Json::array({run.row, run.col_begin, run.col_end, CellValueJson(is_binary, run.value)});
}

namespace {

Json RunsJson(const std::vector<CellRun>& runs) {
  Json json = Json::array();
  // A change does not contain the kind of its layer, so values of binary layers are printed like
  // all numbers.
  for (const CellRun& run : runs) json.push_back(RunJson(/*is_binary=*/false, run));
  return json;
}

client::LayerEntry EntryOf(const LayerStructure& layer) {
  client::LayerEntry entry{layer.spec, layer.extent.num_cells(), std::nullopt, layer.version,
                           PropertiesOf(layer.spec)};
  if (!layer.extent.empty()) entry.extent = layer.extent;
  return entry;
}

}  // namespace

Json LayerJson(const client::LayerEntry& layer) {
  const LayerSpec& spec = layer.spec;
  Json json = {{"name", spec.name},
               {"kind", Text(LayerKindName(spec.kind))},
               {"frame_id", spec.frame_id},
               {"size", layer.size},
               {"version", layer.version}};
  if (!layer.problem.empty()) json["problem"] = layer.problem;
  if (spec.grid) json["grid"] = GridJson(*spec.grid);
  if (layer.extent) {
    json["extent"] = {{"rows", {layer.extent->row_begin, layer.extent->row_end}},
                      {"cols", {layer.extent->col_begin, layer.extent->col_end}}};
  }
  if (spec.kind == LayerKind::kOccupancy) {
    json["thresholds"] = {{"free_below", spec.thresholds.free_below},
                          {"occupied_above", spec.thresholds.occupied_above}};
  }
  if (spec.kind == LayerKind::kExploration) {
    json["explored_rule"] = Text(CellRuleName(spec.explored_rule));
  }
  if (layer.properties.has_cells) json["unit"] = spec.unit;
  if (layer.properties.has_shapes) {
    json["aliases"] = Json::object();
    for (const auto& [alias, labels] : spec.aliases) json["aliases"][alias] = labels;
    json["shape_kinds"] = ShapeKindsJson(spec.shape_kinds);
  }
  json["properties"] = PropertiesJson(layer.properties);
  return json;
}

Json TransformJson(const FrameTransform& transform) {
  return {{"parent_frame_id", transform.parent_frame_id},
          {"child_frame_id", transform.child_frame_id},
          {"parent_from_child", PoseJson(transform.parent_from_child)}};
}

Json ChangeJson(const client::MapChange& change) {
  Json json = Json::object();
  if (!change.layer.empty()) json["layer"] = change.layer;
  json["op"] = Text(ChangeKindName(change.kind));
  if (change.object_id != 0) json["id"] = change.object_id;
  if (change.object) {
    json["entity"] = EntityJson(*change.object);
    json["version"] = change.object->version;
  }
  if (change.object_before) json["before"] = EntityJson(*change.object_before);
  if (change.grid) {
    json["grid"] = GridJson(*change.grid);
    json["runs"] = RunsJson(change.cells);
    if (!change.cells_before.empty()) json["runs_before"] = RunsJson(change.cells_before);
  }
  if (change.layer_now) json["layer_now"] = LayerJson(EntryOf(*change.layer_now));
  if (change.transform) json["transform"] = TransformJson(*change.transform);
  return json;
}

}  // namespace hypermap::cli
