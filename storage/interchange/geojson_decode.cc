#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "map/layers/semantic_layer.h"
#include "nlohmann/json.hpp"
#include "storage/interchange/geojson.h"
#include "storage/interchange/geojson_properties.h"
#include "storage/interchange/names.h"
#include "storage/interchange/repair_log.h"
#include "storage/interchange/status_context.h"

namespace hypermap::storage {
namespace {

using nlohmann::json;

constexpr int kMaxDepth = 32;

absl::StatusOr<json> Parse(absl::string_view data) {
  bool too_deep = false;
  const auto watch_depth = [&too_deep](int depth, json::parse_event_t, json&) {
    too_deep = too_deep || depth > kMaxDepth;
    return !too_deep;
  };
  try {
    json root = json::parse(data.begin(), data.end(), watch_depth);
    if (!too_deep) return root;
  } catch (const json::exception& e) {
    return absl::InvalidArgumentError(absl::StrCat("not JSON: ", e.what()));
  }
  return absl::InvalidArgumentError(
      absl::StrCat("JSON is nested deeper than ", kMaxDepth, " levels"));
}

// The member if it is there and not null.
const json* Member(const json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto it = object.find(key);
  return it == object.end() || it->is_null() ? nullptr : &*it;
}

std::string TextMember(const json& object, const char* key) {
  const json* member = Member(object, key);
  return member && member->is_string() ? member->get<std::string>() : "";
}

// The root as a list of features: a collection's, the one feature, or a bare geometry made one.
absl::StatusOr<std::vector<json>> FeaturesOf(json root) {
  const std::string type = TextMember(root, "type");
  if (type == "FeatureCollection") {
    const json* features = Member(root, "features");
    if (!features || !features->is_array()) {
      return absl::InvalidArgumentError("features is no list");
    }
    return root["features"].get<std::vector<json>>();
  }
  if (type == "Feature") return std::vector<json>{std::move(root)};
  if (type == "Polygon" || type == "MultiPolygon") {
    return std::vector<json>{{{"type", "Feature"}, {"geometry", std::move(root)}}};
  }
  return absl::InvalidArgumentError(
      absl::StrCat("type is \"", CleanWord(type),
                   "\", not FeatureCollection, Feature, Polygon or MultiPolygon"));
}

class Decoder {
 public:
  Decoder(std::string layer, const Snapshot* snapshot, const ImportLimits& limits)
      : layer_(std::move(layer)), snapshot_(snapshot), limits_(limits) {}

  absl::Status Run(json root);
  ImportedMap Take() && {
    imported_.repairs = std::move(repairs_).Take();
    return std::move(imported_);
  }

 private:
  absl::Status ReadFrame(const json& root);
  void OpenLayer();
  absl::Status ReadFeature(const json& feature, const std::string& place);
  absl::Status ReadObjects(const json& feature, std::vector<Polygon> parts,
                           const std::string& place);
  absl::Status ReadFill(const json& feature, std::vector<Polygon> parts, const std::string& place);
  absl::StatusOr<std::vector<Polygon>> ReadGeometry(const json& geometry);
  absl::StatusOr<Polygon> ReadPolygon(const json& rings);
  absl::StatusOr<Ring> ReadRing(const json& positions);
  // The id of the layer's object that the feature stands for; 0 for a new one.
  absl::StatusOr<ObjectId> ReadId(const json& feature);

  const std::string layer_;
  const Snapshot* const snapshot_;
  const ImportLimits limits_;
  std::string frame_id_;  // of the coordinates; empty: the map's own
  const Layer* existing_ = nullptr;
  ImportedMap imported_;
  RepairLog repairs_;
  bool told_of_heights_ = false;
  int num_vertices_ = 0;  // of the polygon being read
  int64_t num_unknown_ids_ = 0;
};

absl::Status Decoder::Run(json root) {
  if (auto status = ValidateName("layer", layer_); !status.ok()) return status;
  if (auto status = ReadFrame(root); !status.ok()) return status;
  if (Member(root, "crs")) {
    repairs_.Add("crs is not looked at: coordinates are taken as metres in the frame");
  }
  absl::StatusOr<std::vector<json>> features = FeaturesOf(std::move(root));
  if (!features.ok()) return features.status();
  if (static_cast<int64_t>(features->size()) > limits_.max_objects) {
    return absl::ResourceExhaustedError(
        absl::StrCat("features has ", features->size(),
                     " entries, more than max_objects = ", limits_.max_objects));
  }
  OpenLayer();
  if (features->empty() && existing_) return absl::InvalidArgumentError("features is empty");
  for (size_t i = 0; i < features->size(); ++i) {
    const std::string place = absl::StrCat("features[", i, "]");
    if (auto status = ReadFeature((*features)[i], place); !status.ok()) return At(place, status);
  }
  if (num_unknown_ids_ > 0) {
    repairs_.Add(absl::StrCat(num_unknown_ids_,
                              " features have ids that are no objects of layer \"", layer_,
                              "\": put as new objects"));
  }
  return absl::OkStatus();
}

absl::Status Decoder::ReadFrame(const json& root) {
  frame_id_ = TextMember(root, "frame");
  if (const json* properties = Member(root, "properties");
      frame_id_.empty() && properties && TextMember(root, "type") == "FeatureCollection") {
    frame_id_ = TextMember(*properties, "frame");
  }
  if (frame_id_.empty()) {
    if (snapshot_) frame_id_ = snapshot_->frame_id;
    return absl::OkStatus();
  }
  imported_.frame_id = frame_id_;
  return ValidateFrameId("frame", frame_id_);
}

void Decoder::OpenLayer() {
  existing_ = snapshot_ ? snapshot_->FindLayer(layer_) : nullptr;
  imported_.layers = {layer_};
  if (existing_) return;
  imported_.batch.edits.push_back(
      CreateLayer{{.name = layer_, .kind = LayerKind::kSemantic, .frame_id = frame_id_}});
}

absl::Status Decoder::ReadFeature(const json& feature, const std::string& place) {
  if (TextMember(feature, "type") != "Feature") {
    return absl::InvalidArgumentError("type is not Feature");
  }
  const bool fills_cells = existing_ && existing_->spec().kind != LayerKind::kSemantic;
  const json* geometry = Member(feature, "geometry");
  if (!geometry) {
    absl::StatusOr<ObjectId> id = ReadId(feature);
    if (!id.ok()) return id.status();
    if (fills_cells || !Member(feature, "id")) {
      return absl::InvalidArgumentError("geometry is missing");
    }
    if (*id == 0) {
      return absl::NotFoundError(
          absl::StrCat("layer \"", layer_, "\" has no object ", feature["id"].dump()));
    }
    imported_.batch.edits.push_back(DeleteObject{layer_, *id});
    return absl::OkStatus();
  }
  absl::StatusOr<std::vector<Polygon>> parts = ReadGeometry(*geometry);
  if (!parts.ok()) return At("geometry", parts.status());
  if (fills_cells) return ReadFill(feature, *std::move(parts), place);
  return ReadObjects(feature, *std::move(parts), place);
}

absl::StatusOr<ObjectId> Decoder::ReadId(const json& feature) {
  const json* id = Member(feature, "id");
  if (!id) return 0;
  const auto* semantic = dynamic_cast<const SemanticLayer*>(existing_);
  if (id->is_number_integer() && semantic && semantic->Find(id->get<int64_t>())) {
    return id->get<int64_t>();
  }
  if (!id->is_number_integer() && !id->is_string()) {
    return absl::InvalidArgumentError("id is neither a number nor a text");
  }
  return 0;
}

absl::Status Decoder::ReadObjects(const json& feature, std::vector<Polygon> parts,
                                  const std::string& place) {
  absl::StatusOr<ObjectId> id = ReadId(feature);
  if (!id.ok()) return id.status();
  if (Member(feature, "id") && *id == 0) ++num_unknown_ids_;
  const json* properties = Member(feature, "properties");
  if (!properties) return absl::InvalidArgumentError("properties.label is missing");
  absl::StatusOr<SemanticObject> object =
      DecodeProperties(*properties, absl::StrCat(place, ".properties"), repairs_);
  if (!object.ok()) return At("properties", object.status());
  if (parts.size() > 1) {
    repairs_.Add(absl::StrCat(place, ": MultiPolygon put as ", parts.size(), " objects"));
  }
  object->id = *id;
  for (Polygon& part : parts) {
    object->polygon = std::move(part);
    imported_.batch.edits.push_back(PutObject{layer_, *object, frame_id_});
    object->id = 0;
  }
  return absl::OkStatus();
}

absl::Status Decoder::ReadFill(const json& feature, std::vector<Polygon> parts,
                               const std::string& place) {
  const json* properties = Member(feature, "properties");
  if (!properties || !properties->is_object() || !properties->contains("value")) {
    return absl::InvalidArgumentError("properties.value is missing");
  }
  absl::StatusOr<std::optional<double>> value =
      DecodeCellValue((*properties)["value"], existing_->spec().kind);
  if (!value.ok()) return At("properties.value", value.status());
  if (Member(feature, "id")) {
    repairs_.Add(absl::StrCat(place, ".id is not looked at: cells have no ids"));
  }
  for (Polygon& part : parts) {
    imported_.batch.edits.push_back(
        FillPolygon{layer_, std::move(part), frame_id_, CellRule::kCentre, *value});
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<Polygon>> Decoder::ReadGeometry(const json& geometry) {
  const std::string type = TextMember(geometry, "type");
  const json* coordinates = Member(geometry, "coordinates");
  if (type != "Polygon" && type != "MultiPolygon") {
    return absl::InvalidArgumentError(
        absl::StrCat("type is \"", CleanWord(type), "\", not Polygon or MultiPolygon"));
  }
  if (!coordinates || !coordinates->is_array() || coordinates->empty()) {
    return absl::InvalidArgumentError("coordinates is no list or empty");
  }
  std::vector<Polygon> parts;
  if (type == "Polygon") {
    absl::StatusOr<Polygon> polygon = ReadPolygon(*coordinates);
    if (!polygon.ok()) return At("coordinates", polygon.status());
    parts.push_back(*std::move(polygon));
    return parts;
  }
  for (size_t i = 0; i < coordinates->size(); ++i) {
    absl::StatusOr<Polygon> polygon = ReadPolygon((*coordinates)[i]);
    if (!polygon.ok()) return At(absl::StrCat("coordinates[", i, "]"), polygon.status());
    parts.push_back(*std::move(polygon));
  }
  return parts;
}

absl::StatusOr<Polygon> Decoder::ReadPolygon(const json& rings) {
  if (!rings.is_array() || rings.empty()) {
    return absl::InvalidArgumentError("a polygon is no list of rings or empty");
  }
  num_vertices_ = 0;
  std::vector<Ring> read;
  for (size_t i = 0; i < rings.size(); ++i) {
    absl::StatusOr<Ring> ring = ReadRing(rings[i]);
    if (!ring.ok()) return At(absl::StrCat("ring ", i), ring.status());
    read.push_back(*std::move(ring));
  }
  Ring outer = std::move(read.front());
  read.erase(read.begin());
  return Polygon::Make(std::move(outer), std::move(read));
}

absl::StatusOr<Ring> Decoder::ReadRing(const json& positions) {
  if (!positions.is_array()) return absl::InvalidArgumentError("not a list of positions");
  num_vertices_ += static_cast<int>(positions.size());
  if (num_vertices_ > limits_.max_vertices_per_polygon) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "more vertices than max_vertices_per_polygon = ", limits_.max_vertices_per_polygon));
  }
  Ring ring;
  ring.reserve(positions.size());
  for (const json& position : positions) {
    const bool is_position = position.is_array() && position.size() >= 2 &&
                             position[0].is_number() && position[1].is_number();
    if (!is_position) {
      return absl::InvalidArgumentError(
          absl::StrCat("vertex ", ring.size(), " is no pair of numbers"));
    }
    if (position.size() > 2 && !std::exchange(told_of_heights_, true)) {
      repairs_.Add("positions have more than two numbers: only x and y are read");
    }
    ring.push_back({position[0].get<double>(), position[1].get<double>()});
  }
  return ring;
}

}  // namespace

absl::StatusOr<ImportedMap> DecodeGeoJson(absl::string_view data, const std::string& layer,
                                          const Snapshot* snapshot, const ImportLimits& limits) {
  if (static_cast<int64_t>(data.size()) > limits.max_unpacked_bytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("file is larger than max_unpacked_bytes = ", limits.max_unpacked_bytes));
  }
  absl::StatusOr<json> root = Parse(data);
  if (!root.ok()) return root.status();
  Decoder decoder(layer, snapshot, limits);
  if (auto status = decoder.Run(*std::move(root)); !status.ok()) return status;
  return std::move(decoder).Take();
}

}  // namespace hypermap::storage
