#include "storage/interchange/geojson_properties.h"

#include <limits>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/values/value_query.h"
#include "storage/interchange/names.h"

namespace hypermap::storage {
namespace {

using nlohmann::json;

bool IsReserved(const std::string& key) {
  static const auto& reserved = *new std::set<std::string>{"label", "classes",    "existence",
                                                           "tags",  "height_min", "height_max"};
  return reserved.contains(key);
}

std::string ToText(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

// Takes the properties one after another; what has been taken is no attribute.
class PropertyReader {
 public:
  PropertyReader(const json& properties, const std::string& place, RepairLog& repairs)
      : properties_(properties), place_(place), repairs_(repairs) {}

  absl::StatusOr<SemanticObject> Read() && {
    if (!properties_.is_object()) return absl::InvalidArgumentError("not an object");
    for (const auto read : {&PropertyReader::ReadLabel, &PropertyReader::ReadClasses,
                            &PropertyReader::ReadExistence, &PropertyReader::ReadTags,
                            &PropertyReader::ReadHeight, &PropertyReader::ReadAttributes}) {
      HYPERMAP_RETURN_IF_ERROR((this->*read)());
    }
    HYPERMAP_RETURN_IF_ERROR(Validate(object_));
    return std::move(object_);
  }

 private:
  // The property, from now on taken; null when it is missing or null.
  const json* Take(const char* key) {
    const auto it = properties_.find(key);
    if (it == properties_.end() || it->is_null()) return nullptr;
    taken_.insert(key);
    return &*it;
  }

  absl::Status ReadLabel() {
    for (const char* key : {"label", "class", "name"}) {
      const json* label = Take(key);
      if (!label) continue;
      if (!label->is_string()) return absl::InvalidArgumentError(absl::StrCat(key, " is no text"));
      const std::string given = label->get<std::string>();
      object_.label = CleanWord(given);
      if (object_.label != given) {
        repairs_.Add(absl::StrCat(place_, ".", key, ": blanks taken out of the label \"",
                                  object_.label, "\""));
      }
      return absl::OkStatus();
    }
    return absl::InvalidArgumentError("label is missing");
  }

  absl::Status ReadClasses() {
    const json* classes = Take("classes");
    if (!classes) {
      object_.classes = {{object_.label, 1.0}};
      return absl::OkStatus();
    }
    if (!classes->is_object()) return absl::InvalidArgumentError("classes is no object");
    for (const auto& [label, confidence] : classes->items()) {
      if (!confidence.is_number()) {
        return absl::InvalidArgumentError(absl::StrCat("classes.", label, " is no number"));
      }
      object_.classes[label] = confidence.get<double>();
    }
    return absl::OkStatus();
  }

  absl::Status ReadExistence() {
    const json* existence = Take("existence");
    if (!existence) return absl::OkStatus();
    if (!existence->is_number()) return absl::InvalidArgumentError("existence is no number");
    object_.existence = existence->get<double>();
    return absl::OkStatus();
  }

  absl::Status ReadTags() {
    const json* tags = Take("tags");
    if (!tags) return absl::OkStatus();
    if (!tags->is_array()) return absl::InvalidArgumentError("tags is no list");
    for (const json& tag : *tags) {
      if (!tag.is_string()) return absl::InvalidArgumentError("tags holds what is no text");
      object_.tags.push_back(tag.get<std::string>());
    }
    return absl::OkStatus();
  }

  absl::Status ReadHeight() {
    const auto number = [this](const char* key) {
      return properties_.contains(key) && properties_[key].is_number();
    };
    if (number("height_min") && number("height_max")) {
      object_.height =
          HeightRange{Take("height_min")->get<double>(), Take("height_max")->get<double>()};
      return absl::OkStatus();
    }
    const auto range = properties_.find("height");
    if (range != properties_.end() && range->is_array() && range->size() == 2 &&
        (*range)[0].is_number() && (*range)[1].is_number()) {
      Take("height");
      object_.height = HeightRange{(*range)[0].get<double>(), (*range)[1].get<double>()};
    }
    return absl::OkStatus();
  }

  absl::Status ReadAttributes() {
    for (const auto& [key, value] : properties_.items()) {
      if (taken_.contains(key) || value.is_null()) continue;
      if (value.is_structured()) {
        repairs_.Add(absl::StrCat(place_, ".", key, ": kept as its JSON text"));
      }
      object_.attributes[key] = ToAttribute(value);
    }
    return absl::OkStatus();
  }

  static AttributeValue ToAttribute(const json& value) {
    if (value.is_boolean()) return value.get<bool>();
    if (value.is_string()) return value.get<std::string>();
    if (value.is_number_unsigned() &&
        value.get<uint64_t>() > uint64_t{std::numeric_limits<int64_t>::max()}) {
      return value.get<double>();
    }
    if (value.is_number_integer()) return value.get<int64_t>();
    if (value.is_number()) return value.get<double>();
    return ToText(value);
  }

  const json& properties_;
  const std::string& place_;
  RepairLog& repairs_;
  std::set<std::string> taken_;
  SemanticObject object_;  // without a shape
};

}  // namespace

absl::StatusOr<SemanticObject> DecodeProperties(const json& properties, const std::string& place,
                                                RepairLog& repairs) {
  return PropertyReader(properties, place, repairs).Read();
}

json EncodeProperties(const SemanticObject& object, std::vector<std::string>& lost) {
  json properties = json::object();
  for (const auto& [key, value] : object.attributes) {
    if (IsReserved(key)) {
      lost.push_back(key);
      continue;
    }
    std::visit([&, &name = key](const auto& v) { properties[name] = v; }, value);
  }
  properties["label"] = object.label;
  properties["classes"] = object.classes;
  properties["existence"] = object.existence;
  properties["tags"] = object.tags;
  if (object.height) {
    properties["height_min"] = object.height->low_m;
    properties["height_max"] = object.height->high_m;
  }
  return properties;
}

absl::StatusOr<std::optional<double>> DecodeCellValue(const json& value, LayerKind kind) {
  if (value.is_null()) return std::nullopt;
  if (value.is_number()) return value.get<double>();
  if (!value.is_string()) {
    return absl::InvalidArgumentError("neither a number, a text, nor null");
  }
  const std::string text = CleanWord(value.get<std::string>());
  const absl::StatusOr<ValueQuery> query = ParseValueQuery(text);
  const auto* keyword = query.ok() ? std::get_if<ValueKeyword>(&*query) : nullptr;
  if (keyword && *keyword == ValueKeyword::kUnknown) return std::nullopt;
  if (keyword && kind == LayerKind::kOccupancy) {
    if (*keyword == ValueKeyword::kFree) return 0.0;
    if (*keyword == ValueKeyword::kOccupied) return 1.0;
  }
  if (keyword && kind == LayerKind::kExploration) {
    if (*keyword == ValueKeyword::kUnexplored) return 0.0;
    if (*keyword == ValueKeyword::kExplored) return 1.0;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("\"", text, "\" is no value of the kind ", LayerKindName(kind)));
}

}  // namespace hypermap::storage
