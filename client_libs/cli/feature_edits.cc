#include "client_libs/cli/feature_edits.h"

#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>
#include <variant>

#include "base/status/status_macros.h"
#include "map/layers/layer_properties.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"
#include "map/snapshot.h"
#include "storage/interchange/geojson.h"

namespace hypermap::cli {
namespace {

// The ids of features that are integers.
std::set<ObjectId> IdsOf(absl::string_view geojson) {
  std::set<ObjectId> ids;
  const auto root = nlohmann::json::parse(geojson.begin(), geojson.end(), nullptr,
                                          /*allow_exceptions=*/false);
  const auto add = [&ids](const nlohmann::json& feature) {
    if (!feature.is_object()) return;
    const auto id = feature.find("id");
    if (id != feature.end() && id->is_number_integer()) ids.insert(id->get<ObjectId>());
  };
  if (!root.is_object()) return ids;
  add(root);
  const auto features = root.find("features");
  if (features == root.end() || !features->is_array()) return ids;
  for (const nlohmann::json& feature : *features) add(feature);
  return ids;
}

// A map whose layer has an object for each of the ids, so that the decoder takes each id for an
// existing object that is to be replaced or deleted.
Snapshot Pretend(const LayerSpec& layer, const std::string& frame_id,
                 const std::set<ObjectId>& ids) {
  Snapshot snapshot;
  snapshot.frame_id = frame_id;
  if (!PropertiesOf(layer).has_shapes) {
    snapshot.layers.emplace(layer.name, MakeEmptyLayer(layer));
    return snapshot;
  }
  std::vector<ObjectPtr> objects;
  for (const ObjectId id : ids) {
    auto object = std::make_shared<SemanticObject>();
    object->id = id;
    object->label = "object";
    object->shape = Shape::MakePointUnchecked({0, 0});
    objects.push_back(std::move(object));
  }
  snapshot.layers.emplace(layer.name, std::make_shared<SemanticLayer>(layer, std::move(objects)));
  return snapshot;
}

// Sets the conditions of one edit.
struct Conditioner {
  const EditConditions& conditions;

  void operator()(PutObject& edit) const {
    edit.time_to_live = conditions.time_to_live;
    if (edit.object.id != 0) edit.if_version = conditions.if_version;
  }
  void operator()(DeleteObject& edit) const { edit.if_version = conditions.if_version; }
  template <typename OtherEdit>
  void operator()(OtherEdit&) const {}
};

}  // namespace

absl::StatusOr<FeatureEdits> ReadFeatureEdits(absl::string_view geojson, const LayerSpec& layer,
                                              const std::string& frame_id,
                                              const EditConditions& conditions) {
  if (!PropertiesOf(layer).has_shapes && (conditions.time_to_live || conditions.if_version)) {
    return absl::InvalidArgumentError("--ttl and --if_version apply only to layers of objects");
  }
  const Snapshot pretended = Pretend(layer, frame_id, IdsOf(geojson));
  HYPERMAP_ASSIGN_OR_RETURN(storage::ImportedMap imported,
                            storage::DecodeGeoJson(geojson, layer.name, &pretended, {}));
  FeatureEdits edits{std::move(imported.batch), std::move(imported.repairs)};
  for (Edit& edit : edits.batch.edits) std::visit(Conditioner{conditions}, edit);
  if (conditions.if_layer_version) {
    edits.batch.if_layers.push_back({layer.name, *conditions.if_layer_version});
  }
  return edits;
}

}  // namespace hypermap::cli
