// Layers without their content, and the geometry of grids, on the wire.
#ifndef HYPERMAP_WIRE_LAYER_H_
#define HYPERMAP_WIRE_LAYER_H_

#include <limits>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/layer.pb.h"
#include "map/grid/grid_geometry.h"
#include "map/layers/layer.h"
#include "map/layers/layer_properties.h"
#include "map/layers/layer_spec.h"
#include "map/snapshot.h"
#include "map/structure.h"

namespace hypermap::wire {

// How a cell without a value is sent where all cells of a box are.
inline constexpr double kUnknownValue = std::numeric_limits<double>::quiet_NaN();

v1::LayerKind EncodeLayerKind(LayerKind kind);
v1::CellRule EncodeCellRule(CellRule rule);
void EncodeGridGeometry(const GridGeometry& geometry, v1::GridGeometry* message);
void EncodeCellBox(const CellBox& box, v1::CellBox* message);
void EncodeAliases(const ValueAliases& aliases,
                   google::protobuf::RepeatedPtrField<v1::ValueAlias>* message);
void EncodeLayerProperties(const LayerProperties& properties, v1::LayerProperties* message);
LayerProperties DecodeLayerProperties(const v1::LayerProperties& message);
void EncodeLayerSpec(const LayerSpec& spec, v1::Layer* message);
// Encodes the spec with the layer's size, extent, version and properties.
void EncodeLayer(const Layer& layer, v1::Layer* message, Revision version = 0);
// Encodes a layer whose content can't be read: as an empty one, with its problem.
void EncodeLayer(const DamagedLayer& layer, v1::Layer* message, Revision version);
// Encodes a layer without the size of a semantic layer, which its structure does not contain.
void EncodeLayer(const LayerStructure& layer, v1::Layer* message);

// INVALID_ARGUMENT for a kind that is missing or unknown.
absl::StatusOr<LayerKind> DecodeLayerKind(absl::string_view field, v1::LayerKind kind);
// kCentre if the rule is missing; INVALID_ARGUMENT if it is unknown.
absl::StatusOr<CellRule> DecodeCellRule(absl::string_view field, v1::CellRule rule);
absl::StatusOr<GridGeometry> DecodeGridGeometry(absl::string_view field,
                                                const v1::GridGeometry& message);
CellBox DecodeCellBox(const v1::CellBox& message);
// INVALID_ARGUMENT for an alias that occurs twice; FoldAliases checks everything else.
absl::StatusOr<ValueAliases> DecodeAliases(
    absl::string_view field, const google::protobuf::RepeatedPtrField<v1::ValueAlias>& message);
// Does not check what Validate(LayerSpec) checks, because an empty frame_id of a request is still
// to be replaced by the map's own. Ignores size, extent, version and properties.
absl::StatusOr<LayerSpec> DecodeLayerSpec(absl::string_view field, const v1::Layer& message);
absl::StatusOr<LayerStructure> DecodeLayerStructure(absl::string_view field,
                                                    const v1::Layer& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_LAYER_H_
