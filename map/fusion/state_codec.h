// States of strategies as bytes: CBOR (RFC 8949) with exact numbers. Arrays of cells are byte
// strings of little-endian IEEE 754 singles.
#ifndef HYPERMAP_MAP_FUSION_STATE_CODEC_H_
#define HYPERMAP_MAP_FUSION_STATE_CODEC_H_

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/geometry/polygon.h"
#include "map/objects/semantic_object.h"

namespace hypermap::fusion {

nlohmann::json EncodePolygon(const Polygon& polygon);
nlohmann::json EncodeObject(const SemanticObject& object);
nlohmann::json EncodeFloats(const std::vector<float>& values);

// These throw nlohmann::json::exception for malformed input, which DecodeState catches.
Polygon DecodePolygon(const nlohmann::json& json);
SemanticObject DecodeObject(const nlohmann::json& json);
std::vector<float> DecodeFloats(const nlohmann::json& json);

// Wraps `content` with the name of the strategy and the version of its format. DecodeState passes
// the content to `read` and returns DATA_LOSS if the bytes are not a state of this strategy and
// version, or if `read` throws.
std::string EncodeState(absl::string_view strategy, int version, nlohmann::json content);
absl::Status DecodeState(absl::string_view strategy, int version, absl::string_view bytes,
                         const std::function<void(const nlohmann::json&)>& read);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_STATE_CODEC_H_
