#include "map/fusion/state_codec.h"

#include <bit>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "map/geometry/coordinates.h"

namespace hypermap::fusion {

using nlohmann::json;

static_assert(std::endian::native == std::endian::little, "floats are written as they lie");

json EncodePolygon(const Polygon& polygon) {
  json rings = json::array();
  for (const Ring& ring : polygon.rings()) {
    json numbers = json::array();
    for (const Point& p : ring) {
      numbers.push_back(p.x);
      numbers.push_back(p.y);
    }
    rings.push_back(std::move(numbers));
  }
  return rings;
}

// Vertices that can belong to a shape of at least `least` vertices. A shape with fewer, or with
// coordinates that are not finite, has no centroid and breaks the indexes.
std::vector<Point> DecodeVertices(const json& numbers, size_t least) {
  std::vector<Point> vertices;
  for (size_t i = 0; i + 1 < numbers.size(); i += 2) {
    vertices.push_back({numbers[i].get<double>(), numbers[i + 1].get<double>()});
  }
  if (vertices.size() < least || !CheckVertices("vertices", vertices).ok()) {
    throw std::runtime_error("a shape without valid vertices");
  }
  return vertices;
}

Polygon DecodePolygon(const json& encoded) {
  Rings rings;
  for (const json& numbers : encoded) rings.push_back(DecodeVertices(numbers, 3));
  return rings.empty() ? Polygon() : Polygon::MakeUnchecked(std::move(rings));
}

json EncodeShape(const Shape& shape) {
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      return {{"polygon", EncodePolygon(shape.polygon())}};
    case ShapeKind::kLineString: {
      json numbers = json::array();
      for (const Point& p : shape.line_string().vertices()) {
        numbers.push_back(p.x);
        numbers.push_back(p.y);
      }
      return {{"line_string", std::move(numbers)}};
    }
    case ShapeKind::kPoint:
      break;
  }
  return {{"point", {shape.point().x, shape.point().y}}};
}

Shape DecodeShape(const json& encoded) {
  if (encoded.contains("point")) {
    return Shape::MakePointUnchecked(DecodeVertices(encoded["point"], 1).front());
  }
  if (encoded.contains("line_string")) {
    return LineString::MakeUnchecked(DecodeVertices(encoded["line_string"], 2));
  }
  Polygon polygon = DecodePolygon(encoded.at("polygon"));
  if (polygon.empty()) throw std::runtime_error("a shape without a ring");
  return polygon;
}

json EncodeObject(const SemanticObject& object) {
  json encoded = EncodeShape(object.shape);
  encoded.update({{"label", object.label},
                  {"classes", object.classes},
                  {"existence", object.existence},
                  {"tags", object.tags}});
  if (object.height) encoded["height"] = {object.height->low_m, object.height->high_m};
  json attributes = json::object();
  for (const auto& [name, value] : object.attributes) {
    std::visit([&, &key = name](const auto& v) { attributes[key] = v; }, value);
  }
  encoded["attributes"] = std::move(attributes);
  if (object.expires_at) encoded["expires_at_ns"] = absl::ToUnixNanos(*object.expires_at);
  return encoded;
}

SemanticObject DecodeObject(const json& encoded) {
  SemanticObject object;
  encoded.at("label").get_to(object.label);
  encoded.at("classes").get_to(object.classes);
  encoded.at("existence").get_to(object.existence);
  object.shape = DecodeShape(encoded);
  encoded.at("tags").get_to(object.tags);
  if (encoded.contains("height")) {
    object.height = {encoded["height"].at(0).get<double>(), encoded["height"].at(1).get<double>()};
  }
  if (encoded.contains("expires_at_ns")) {
    object.expires_at = absl::FromUnixNanos(encoded["expires_at_ns"].get<int64_t>());
  }
  for (const auto& [name, value] : encoded.at("attributes").items()) {
    if (value.is_boolean()) {
      object.attributes[name] = value.get<bool>();
    } else if (value.is_number_integer()) {
      object.attributes[name] = value.get<int64_t>();
    } else if (value.is_number()) {
      object.attributes[name] = value.get<double>();
    } else {
      object.attributes[name] = value.get<std::string>();
    }
  }
  return object;
}

json EncodeFloats(const std::vector<float>& values) {
  std::vector<uint8_t> bytes(values.size() * sizeof(float));
  if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return json::binary(std::move(bytes));
}

std::vector<float> DecodeFloats(const json& encoded) {
  const std::vector<uint8_t>& bytes = encoded.get_binary();
  std::vector<float> values(bytes.size() / sizeof(float));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(float));
  return values;
}

// Reads CBOR without keeping it. Stops at an array or object that is nested deeper than states are.
class DepthCheck : public nlohmann::json_sax<json> {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool key(string_t&) override { return true; }
  bool start_object(size_t) override { return ++depth_ <= kMaxDepth; }
  bool end_object() override { return --depth_ >= 0; }
  bool start_array(size_t) override { return ++depth_ <= kMaxDepth; }
  bool end_array() override { return --depth_ >= 0; }
  bool parse_error(size_t, const std::string&, const json::exception&) override { return false; }

  bool is_too_deep() const { return depth_ > kMaxDepth; }

 private:
  static constexpr int kMaxDepth = 32;

  int depth_ = 0;
};

// The parser calls itself for each level, so that deep nesting would exhaust the stack.
void CheckDepth(absl::string_view bytes) {
  DepthCheck check;
  json::sax_parse(bytes.begin(), bytes.end(), &check, json::input_format_t::cbor);
  if (check.is_too_deep()) throw std::runtime_error("nested too deep");
}

std::string EncodeState(absl::string_view strategy, int version, json content) {
  const json whole = {
      {"strategy", std::string(strategy)}, {"version", version}, {"content", std::move(content)}};
  std::string bytes;
  json::to_cbor(whole, bytes);
  return bytes;
}

absl::Status DecodeState(absl::string_view strategy, int version, absl::string_view bytes,
                         const std::function<void(const json&)>& read) {
  try {
    CheckDepth(bytes);
    const json whole = json::from_cbor(bytes.begin(), bytes.end());
    if (whole.at("strategy").get<std::string>() != std::string(strategy)) {
      return absl::DataLossError(absl::StrCat("fusion state: not one of '", strategy, "'"));
    }
    if (whole.at("version").get<int>() != version) {
      return absl::DataLossError("fusion state: of another version");
    }
    read(whole.at("content"));
  } catch (const std::exception& e) {
    return absl::DataLossError(absl::StrCat("fusion state: ", e.what()));
  }
  return absl::OkStatus();
}

}  // namespace hypermap::fusion
