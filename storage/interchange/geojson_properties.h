// The properties of GeoJSON features, both ways. Private to the GeoJSON files.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_GEOJSON_PROPERTIES_H_
#define HYPERMAP_STORAGE_INTERCHANGE_GEOJSON_PROPERTIES_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/layers/layer_spec.h"
#include "map/layers/semantic_object.h"
#include "nlohmann/json.hpp"
#include "storage/interchange/repair_log.h"

namespace hypermap::storage {

// An object without polygon: "label" (or "class", or "name"), "classes" {label: confidence},
// "existence", "tags", "height_min" with "height_max" (or "height" [low, high]); all other members
// are attributes, nested ones as their JSON text. `place` begins the lines of `repairs`.
absl::StatusOr<SemanticObject> DecodeProperties(const nlohmann::json& properties,
                                                const std::string& place, RepairLog& repairs);

// The other way round. Attributes with the name of another property can't be carried: their names
// are added to `lost`.
nlohmann::json EncodeProperties(const SemanticObject& object, std::vector<std::string>& lost);

// The value of cells: a number, a keyword that stands for one in this kind, or null and "unknown".
absl::StatusOr<std::optional<double>> DecodeCellValue(const nlohmann::json& value, LayerKind kind);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_GEOJSON_PROPERTIES_H_
