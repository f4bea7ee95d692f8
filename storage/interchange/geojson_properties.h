// The properties of GeoJSON features, both ways. Private to the GeoJSON files.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_GEOJSON_PROPERTIES_H_
#define HYPERMAP_STORAGE_INTERCHANGE_GEOJSON_PROPERTIES_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/layers/layer_spec.h"
#include "map/objects/semantic_object.h"
#include "nlohmann/json.hpp"
#include "storage/interchange/repair_log.h"

namespace hypermap::storage {

// Decodes an object without its shape from "label" (or "class", or "name"), "classes" {label:
// confidence}, "existence", "tags", "height_min" with "height_max" (or "height" [low, high]). All
// other members are attributes, nested ones as their JSON text. `place` begins the lines of
// `repairs`. INVALID_ARGUMENT naming the property.
absl::StatusOr<SemanticObject> DecodeProperties(const nlohmann::json& properties,
                                                const std::string& place, RepairLog& repairs);

// Encodes all of an object but its id and shape. An attribute with the name of another property
// can't be written: its name is added to `lost`.
nlohmann::json EncodeProperties(const SemanticObject& object, std::vector<std::string>& lost);

// Decodes a cell value: a number, or a keyword that stands for one in layers of this kind; null and
// "unknown" give nullopt.
absl::StatusOr<std::optional<double>> DecodeCellValue(const nlohmann::json& value, LayerKind kind);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_GEOJSON_PROPERTIES_H_
