#include "storage/encoding/object_json.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <variant>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace hypermap::storage {
namespace {

using Json = nlohmann::json;

// The usual texts of columns without content, for which no parser is needed.
constexpr absl::string_view kEmptyObject = "{}";
constexpr absl::string_view kEmptyArray = "[]";

absl::StatusOr<std::string> Dump(const char* what, const Json& json) {
  try {
    return json.dump();
  } catch (const Json::exception&) {
    return absl::InvalidArgumentError(absl::StrCat("object.", what, " is not UTF-8"));
  }
}

absl::Status NotFinite(const char* what, const std::string& key) {
  return absl::InvalidArgumentError(absl::StrCat("object.", what, "[", key, "] is not finite"));
}

absl::Status Malformed(const char* what, const char* expected) {
  return absl::DataLossError(absl::StrCat("column ", what, " is not ", expected));
}

// Returns a discarded value if the text is not JSON.
Json Parse(absl::string_view text) {
  return Json::parse(text.begin(), text.end(), /*cb=*/nullptr, /*allow_exceptions=*/false);
}

std::optional<AttributeValue> DecodeAttribute(const Json& value) {
  switch (value.type()) {
    case Json::value_t::boolean:
      return value.get<bool>();
    case Json::value_t::string:
      return value.get<std::string>();
    case Json::value_t::number_float:
      return value.get<double>();
    case Json::value_t::number_integer:
      return value.get<int64_t>();
    case Json::value_t::number_unsigned:
      if (value.get<uint64_t>() > uint64_t{std::numeric_limits<int64_t>::max()}) return {};
      return value.get<int64_t>();
    default:
      return std::nullopt;
  }
}

}  // namespace

absl::StatusOr<std::string> EncodeClasses(const Classes& classes) {
  if (classes.empty()) return std::string(kEmptyObject);
  Json json = Json::object();
  for (const auto& [label, confidence] : classes) {
    if (!std::isfinite(confidence)) return NotFinite("classes", label);
    json[label] = confidence;
  }
  return Dump("classes", json);
}

absl::StatusOr<std::string> EncodeTags(const Tags& tags) {
  if (tags.empty()) return std::string(kEmptyArray);
  return Dump("tags", Json(tags));
}

absl::StatusOr<std::string> EncodeAttributes(const Attributes& attributes) {
  if (attributes.empty()) return std::string(kEmptyObject);
  Json json = Json::object();
  for (const auto& [name, value] : attributes) {
    if (const double* number = std::get_if<double>(&value); number && !std::isfinite(*number)) {
      return NotFinite("attributes", name);
    }
    std::visit([&json, &name = name](const auto& v) { json[name] = v; }, value);
  }
  return Dump("attributes", json);
}

absl::StatusOr<Classes> DecodeClasses(absl::string_view text) {
  Classes classes;
  if (text == kEmptyObject) return classes;
  const Json json = Parse(text);
  if (!json.is_object()) return Malformed("classes", "a JSON object");
  for (const auto& [label, confidence] : json.items()) {
    if (!confidence.is_number()) return Malformed("classes", "an object of numbers");
    classes.emplace(label, confidence.get<double>());
  }
  return classes;
}

absl::StatusOr<Tags> DecodeTags(absl::string_view text) {
  Tags tags;
  if (text == kEmptyArray) return tags;
  const Json json = Parse(text);
  if (!json.is_array()) return Malformed("tags", "a JSON array");
  for (const Json& tag : json) {
    if (!tag.is_string()) return Malformed("tags", "an array of strings");
    tags.push_back(tag.get<std::string>());
  }
  return tags;
}

absl::StatusOr<Attributes> DecodeAttributes(absl::string_view text) {
  Attributes attributes;
  if (text == kEmptyObject) return attributes;
  const Json json = Parse(text);
  if (!json.is_object()) return Malformed("attributes", "a JSON object");
  for (const auto& [name, value] : json.items()) {
    std::optional<AttributeValue> attribute = DecodeAttribute(value);
    if (!attribute) return Malformed("attributes", "an object of plain values");
    attributes.emplace(name, *std::move(attribute));
  }
  return attributes;
}

}  // namespace hypermap::storage
