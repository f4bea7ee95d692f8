#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
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
// The parser checks for memory and cancellation after this many values or bytes.
constexpr int64_t kValuesPerLook = 1024;
constexpr int64_t kBytesPerLook = 64 << 10;
// Estimated memory of a value, and of a key of an object, besides the bytes of their text.
constexpr int64_t kBytesOfValue = 64;
constexpr int64_t kBytesOfKey = 64;

// Builds the document as json::parse does, but stops when the text is nested too deep, needs too
// much memory, or the work is cancelled. json::parse with a callback would visit all entries of an
// object or array again after each object in it.
class BoundedParser : public nlohmann::detail::json_sax_dom_parser<json> {
 public:
  using Base = nlohmann::detail::json_sax_dom_parser<json>;

  explicit BoundedParser(json& root) : Base(root) {}

  // Why the parser has ended before the end of the text.
  const absl::Status& status() const { return status_; }

  bool null() { return Count() && Base::null(); }
  bool boolean(bool value) { return Count() && Base::boolean(value); }
  bool number_integer(json::number_integer_t value) {
    return Count() && Base::number_integer(value);
  }
  bool number_unsigned(json::number_unsigned_t value) {
    return Count() && Base::number_unsigned(value);
  }
  bool number_float(json::number_float_t value, const std::string& text) {
    return Count() && Base::number_float(value, text);
  }
  bool string(std::string& value) { return Count(value.size()) && Base::string(value); }
  bool key(std::string& value) { return Count(value.size() + kBytesOfKey) && Base::key(value); }
  bool start_object(size_t size) { return Enter() && Base::start_object(size); }
  bool start_array(size_t size) { return Enter() && Base::start_array(size); }
  bool end_object() { return Leave() && Base::end_object(); }
  bool end_array() { return Leave() && Base::end_array(); }

 private:
  bool Count(size_t more_bytes = 0) {
    bytes_ += kBytesOfValue + static_cast<int64_t>(more_bytes);
    if (++values_ % kValuesPerLook != 0 && bytes_ < kBytesPerLook) return true;
    status_ = TakeMemory(std::exchange(bytes_, 0));
    if (status_.ok()) status_ = CheckCancelled();
    return status_.ok();
  }
  bool Enter() {
    if (++depth_ <= kMaxDepth) return Count();
    status_ = absl::InvalidArgumentError(
        absl::StrCat("JSON is nested deeper than ", kMaxDepth, " levels"));
    return false;
  }
  bool Leave() {
    --depth_;
    return true;
  }

  absl::Status status_;
  int depth_ = 0;
  int64_t values_ = 0;
  int64_t bytes_ = 0;  // not taken yet
};

absl::StatusOr<json> Parse(absl::string_view data) {
  json root;
  BoundedParser parser(root);
  try {
    if (json::sax_parse(data.begin(), data.end(), &parser)) return root;
  } catch (const json::exception& e) {
    return absl::InvalidArgumentError(absl::StrCat("not JSON: ", e.what()));
  }
  return parser.status();
}

// The member, or null when it is missing or null.
const json* Member(const json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto it = object.find(key);
  return it == object.end() || it->is_null() ? nullptr : &*it;
}

std::string TextMember(const json& object, const char* key) {
  const json* member = Member(object, key);
  return member && member->is_string() ? member->get<std::string>() : "";
}

// A type of geometry that can be decoded, and the kind of shape of each of its parts.
struct GeometryType {
  const char* name;
  ShapeKind part;
  bool is_multi;
};
constexpr GeometryType kGeometryTypes[] = {{"Polygon", ShapeKind::kPolygon, false},
                                           {"MultiPolygon", ShapeKind::kPolygon, true},
                                           {"LineString", ShapeKind::kLineString, false},
                                           {"MultiLineString", ShapeKind::kLineString, true},
                                           {"Point", ShapeKind::kPoint, false},
                                           {"MultiPoint", ShapeKind::kPoint, true}};

const GeometryType* FindGeometryType(absl::string_view name) {
  for (const GeometryType& type : kGeometryTypes) {
    if (name == type.name) return &type;
  }
  return nullptr;
}

absl::Status UnknownType(absl::string_view type, absl::string_view others) {
  if (type == "GeometryCollection") {
    return absl::InvalidArgumentError(
        "type is \"GeometryCollection\": an object has one shape, so give each geometry a feature "
        "of "
        "its own");
  }
  std::vector<absl::string_view> known;
  for (const GeometryType& geometry : kGeometryTypes) known.push_back(geometry.name);
  return absl::InvalidArgumentError(absl::StrCat("type is \"", CleanWord(std::string(type)),
                                                 "\", not one of ", others,
                                                 absl::StrJoin(known, ", ")));
}

// The features of the root, which is a collection, one feature or a bare geometry.
absl::StatusOr<std::vector<json>> FeaturesOf(json root) {
  const std::string type = TextMember(root, "type");
  if (type == "FeatureCollection") {
    const json* found = Member(root, "features");
    if (!found || !found->is_array()) {
      return absl::InvalidArgumentError("features is no list");
    }
    return std::move(root["features"].get_ref<json::array_t&>());
  }
  if (type == "Feature") return std::vector<json>{std::move(root)};
  if (FindGeometryType(type) != nullptr) {
    return std::vector<json>{{{"type", "Feature"}, {"geometry", std::move(root)}}};
  }
  return UnknownType(type, "FeatureCollection, Feature, ");
}

class Decoder {
 public:
  Decoder(std::string layer, const Snapshot* snapshot, const Limits& limits)
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
  absl::Status ReadDeletion(const json& feature);
  absl::Status ReadObjects(const json& feature, const json& geometry, const std::string& place);
  absl::Status ReadFill(const json& feature, const json& geometry, const std::string& place);
  // One shape, or one for each part of a multi-part geometry.
  absl::StatusOr<std::vector<Shape>> ReadGeometry(const json& geometry);
  absl::StatusOr<Shape> ReadPart(ShapeKind kind, const json& coordinates);
  absl::StatusOr<Polygon> ReadPolygon(const json& rings);
  absl::StatusOr<std::vector<Point>> ReadPositions(const json& positions);
  // Nullopt when it is not a position.
  std::optional<Point> ReadPosition(const json& position);
  // The id of the object of the layer that the feature replaces; 0 for a new one.
  absl::StatusOr<ObjectId> ReadId(const json& feature);

  const std::string layer_;
  const Snapshot* const snapshot_;
  const Limits limits_;
  std::string frame_id_;  // of the coordinates; empty: the map's own
  const Layer* existing_ = nullptr;
  ImportedMap imported_;
  RepairLog repairs_;
  bool told_of_heights_ = false;
  int num_vertices_ = 0;  // of the shape being read
  int64_t num_objects_ = 0;
  int64_t num_unknown_ids_ = 0;
};

absl::Status Decoder::Run(json root) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("layer", layer_));
  HYPERMAP_RETURN_IF_ERROR(ReadFrame(root));
  if (Member(root, "crs")) {
    repairs_.Add("crs is not looked at: coordinates are taken as metres in the frame");
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<json> features, FeaturesOf(std::move(root)));
  if (static_cast<int64_t>(features.size()) > limits_.max_import_objects) {
    return absl::ResourceExhaustedError(
        absl::StrCat("features has ", features.size(),
                     " entries, more than --max_import_objects = ", limits_.max_import_objects));
  }
  OpenLayer();
  if (features.empty() && existing_) return absl::InvalidArgumentError("features is empty");
  for (size_t i = 0; i < features.size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const std::string place = absl::StrCat("features[", i, "]");
    if (auto status = ReadFeature(features[i], place); !status.ok()) return At(place, status);
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
  if (const json* geometry = Member(feature, "geometry")) {
    return fills_cells ? ReadFill(feature, *geometry, place)
                       : ReadObjects(feature, *geometry, place);
  }
  if (fills_cells || !Member(feature, "id")) {
    return absl::InvalidArgumentError("geometry is missing");
  }
  return ReadDeletion(feature);
}

absl::Status Decoder::ReadDeletion(const json& feature) {
  HYPERMAP_ASSIGN_OR_RETURN(const ObjectId id, ReadId(feature));
  if (id == 0) {
    return absl::NotFoundError(
        absl::StrCat("layer \"", layer_, "\" has no object ", feature["id"].dump()));
  }
  imported_.batch.edits.push_back(DeleteObject{layer_, id});
  return absl::OkStatus();
}

absl::StatusOr<ObjectId> Decoder::ReadId(const json& feature) {
  const json* id = Member(feature, "id");
  if (!id) return 0;
  const auto* semantic = AsSemantic(existing_);
  if (id->is_number_integer() && semantic && semantic->Find(id->get<int64_t>())) {
    return id->get<int64_t>();
  }
  if (!id->is_number_integer() && !id->is_string()) {
    return absl::InvalidArgumentError("id is neither a number nor a text");
  }
  return 0;
}

absl::Status Decoder::ReadObjects(const json& feature, const json& geometry,
                                  const std::string& place) {
  absl::StatusOr<std::vector<Shape>> parts = ReadGeometry(geometry);
  if (!parts.ok()) return At("geometry", parts.status());
  HYPERMAP_ASSIGN_OR_RETURN(const ObjectId id, ReadId(feature));
  if (Member(feature, "id") && id == 0) ++num_unknown_ids_;
  const json* properties = Member(feature, "properties");
  if (!properties) return absl::InvalidArgumentError("properties.label is missing");
  absl::StatusOr<SemanticObject> object =
      DecodeProperties(*properties, absl::StrCat(place, ".properties"), repairs_);
  if (!object.ok()) return At("properties", object.status());
  if (parts->size() > 1) {
    repairs_.Add(absl::StrCat(place, ": ", TextMember(geometry, "type"), " put as ", parts->size(),
                              " objects"));
  }
  num_objects_ += static_cast<int64_t>(parts->size());
  if (num_objects_ > limits_.max_import_objects) {
    return absl::ResourceExhaustedError(
        absl::StrCat("more objects than --max_import_objects = ", limits_.max_import_objects));
  }
  object->id = id;
  for (Shape& part : *parts) {
    object->shape = std::move(part);
    HYPERMAP_RETURN_IF_ERROR(TakeMemory(ByteSize(*object)));
    imported_.batch.edits.push_back(PutObject{layer_, *object, frame_id_});
    object->id = 0;
  }
  return absl::OkStatus();
}

absl::Status Decoder::ReadFill(const json& feature, const json& geometry,
                               const std::string& place) {
  const GeometryType* type = FindGeometryType(TextMember(geometry, "type"));
  if (type != nullptr && type->part != ShapeKind::kPolygon) {
    return absl::InvalidArgumentError(
        absl::StrCat("geometry: type is \"", type->name, "\", but only polygons fill cells"));
  }
  absl::StatusOr<std::vector<Shape>> parts = ReadGeometry(geometry);
  if (!parts.ok()) return At("geometry", parts.status());
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
  for (const Shape& part : *parts) {
    imported_.batch.edits.push_back(
        FillPolygon{layer_, part.polygon(), frame_id_, CellRule::kCentre, *value});
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<Shape>> Decoder::ReadGeometry(const json& geometry) {
  const std::string name = TextMember(geometry, "type");
  const GeometryType* type = FindGeometryType(name);
  if (type == nullptr) return UnknownType(name, "");
  const json* coordinates = Member(geometry, "coordinates");
  if (!coordinates || !coordinates->is_array() || coordinates->empty()) {
    return absl::InvalidArgumentError("coordinates is no list or empty");
  }
  std::vector<Shape> parts;
  if (!type->is_multi) {
    absl::StatusOr<Shape> part = ReadPart(type->part, *coordinates);
    if (!part.ok()) return At("coordinates", part.status());
    parts.push_back(*std::move(part));
    return parts;
  }
  for (size_t i = 0; i < coordinates->size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    absl::StatusOr<Shape> part = ReadPart(type->part, (*coordinates)[i]);
    if (!part.ok()) return At(absl::StrCat("coordinates[", i, "]"), part.status());
    parts.push_back(*std::move(part));
  }
  return parts;
}

absl::StatusOr<Shape> Decoder::ReadPart(ShapeKind kind, const json& coordinates) {
  num_vertices_ = 0;
  switch (kind) {
    case ShapeKind::kPolygon:
      return ReadPolygon(coordinates);
    case ShapeKind::kLineString: {
      HYPERMAP_ASSIGN_OR_RETURN(std::vector<Point> vertices, ReadPositions(coordinates));
      return LineString::Make(std::move(vertices));
    }
    case ShapeKind::kPoint:
      break;
  }
  const std::optional<Point> point = ReadPosition(coordinates);
  if (!point) return absl::InvalidArgumentError("not a pair of numbers");
  return Shape::MakePoint(*point);
}

absl::StatusOr<Polygon> Decoder::ReadPolygon(const json& rings) {
  if (!rings.is_array() || rings.empty()) {
    return absl::InvalidArgumentError("a polygon is no list of rings or empty");
  }
  std::vector<Ring> read;
  for (size_t i = 0; i < rings.size(); ++i) {
    absl::StatusOr<Ring> ring = ReadPositions(rings[i]);
    if (!ring.ok()) return At(absl::StrCat("ring ", i), ring.status());
    read.push_back(*std::move(ring));
  }
  Ring outer = std::move(read.front());
  read.erase(read.begin());
  return Polygon::Make(std::move(outer), std::move(read));
}

absl::StatusOr<std::vector<Point>> Decoder::ReadPositions(const json& positions) {
  if (!positions.is_array()) return absl::InvalidArgumentError("not a list of positions");
  num_vertices_ += static_cast<int>(positions.size());
  if (num_vertices_ > limits_.max_vertices) {
    return absl::ResourceExhaustedError(
        absl::StrCat("more vertices than --max_vertices = ", limits_.max_vertices));
  }
  std::vector<Point> points;
  points.reserve(positions.size());
  for (const json& position : positions) {
    const std::optional<Point> point = ReadPosition(position);
    if (!point) {
      return absl::InvalidArgumentError(
          absl::StrCat("vertex ", points.size(), " is no pair of numbers"));
    }
    points.push_back(*point);
  }
  return points;
}

std::optional<Point> Decoder::ReadPosition(const json& position) {
  const bool is_position = position.is_array() && position.size() >= 2 && position[0].is_number() &&
                           position[1].is_number();
  if (!is_position) return std::nullopt;
  if (position.size() > 2 && !std::exchange(told_of_heights_, true)) {
    repairs_.Add("positions have more than two numbers: only x and y are read");
  }
  return Point{position[0].get<double>(), position[1].get<double>()};
}

}  // namespace

absl::StatusOr<ImportedMap> DecodeGeoJson(absl::string_view data, const std::string& layer,
                                          const Snapshot* snapshot, const Limits& limits) {
  if (static_cast<int64_t>(data.size()) > limits.max_unpacked_bytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("file is larger than --max_unpacked_bytes = ", limits.max_unpacked_bytes));
  }
  HYPERMAP_ASSIGN_OR_RETURN(json root, Parse(data));
  Decoder decoder(layer, snapshot, limits);
  HYPERMAP_RETURN_IF_ERROR(decoder.Run(std::move(root)));
  return std::move(decoder).Take();
}

}  // namespace hypermap::storage
