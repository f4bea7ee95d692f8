// States as bytes: CBOR (RFC 8949), numbers exact. Arrays of cells are byte strings of
// little-endian IEEE 754 singles.
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

// These throw nlohmann::json::exception for what they can't read; see Decoded.
Polygon DecodePolygon(const nlohmann::json& json);
SemanticObject DecodeObject(const nlohmann::json& json);
std::vector<float> DecodeFloats(const nlohmann::json& json);

// A state of `strategy` at `version` around its content, and back: DATA_LOSS for bytes that are no
// such state.
std::string EncodeState(absl::string_view strategy, int version, nlohmann::json content);
absl::Status DecodeState(absl::string_view strategy, int version, absl::string_view bytes,
                         const std::function<void(const nlohmann::json&)>& read);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_STATE_CODEC_H_
