#include "wire/layer.h"

#include <array>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/grid_layer.h"
#include "wire/field.h"
#include "wire/geometry.h"

namespace hypermap::wire {
namespace {

constexpr std::array<std::pair<LayerKind, v1::LayerKind>, 4> kKinds{{
    {LayerKind::kOccupancy, v1::LAYER_KIND_OCCUPANCY},
    {LayerKind::kExploration, v1::LAYER_KIND_EXPLORATION},
    {LayerKind::kSemantic, v1::LAYER_KIND_SEMANTIC},
    {LayerKind::kScalar, v1::LAYER_KIND_SCALAR},
}};

constexpr std::array<std::pair<CellRule, v1::CellRule>, 3> kRules{{
    {CellRule::kCentre, v1::CELL_RULE_CENTRE},
    {CellRule::kCovered, v1::CELL_RULE_COVERED},
    {CellRule::kTouched, v1::CELL_RULE_TOUCHED},
}};

}  // namespace

v1::LayerKind EncodeLayerKind(LayerKind kind) {
  for (const auto& [domain, message] : kKinds) {
    if (domain == kind) return message;
  }
  return v1::LAYER_KIND_UNSPECIFIED;
}

absl::StatusOr<LayerKind> DecodeLayerKind(absl::string_view field, v1::LayerKind kind) {
  for (const auto& [domain, message] : kKinds) {
    if (message == kind) return domain;
  }
  if (kind == v1::LAYER_KIND_UNSPECIFIED) return InvalidField(field, "is missing");
  return InvalidField(field, absl::StrCat("is not a known kind: ", static_cast<int>(kind)));
}

v1::CellRule EncodeCellRule(CellRule rule) {
  for (const auto& [domain, message] : kRules) {
    if (domain == rule) return message;
  }
  return v1::CELL_RULE_UNSPECIFIED;
}

absl::StatusOr<CellRule> DecodeCellRule(absl::string_view field, v1::CellRule rule) {
  if (rule == v1::CELL_RULE_UNSPECIFIED) return CellRule::kCentre;
  for (const auto& [domain, message] : kRules) {
    if (message == rule) return domain;
  }
  return InvalidField(field, absl::StrCat("is not a known rule: ", static_cast<int>(rule)));
}

void EncodeGridGeometry(const GridGeometry& geometry, v1::GridGeometry* message) {
  EncodePose(geometry.layer_from_grid, message->mutable_origin());
  message->set_resolution_m(geometry.resolution_m);
}

absl::StatusOr<GridGeometry> DecodeGridGeometry(absl::string_view field,
                                                const v1::GridGeometry& message) {
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform origin,
                            DecodePose(absl::StrCat(field, ".origin"), message.origin()));
  return GridGeometry{origin, message.resolution_m()};
}

void EncodeCellBox(const CellBox& box, v1::CellBox* message) {
  message->set_row_begin(box.row_begin);
  message->set_row_end(box.row_end);
  message->set_col_begin(box.col_begin);
  message->set_col_end(box.col_end);
}

CellBox DecodeCellBox(const v1::CellBox& message) {
  return {message.row_begin(), message.row_end(), message.col_begin(), message.col_end()};
}

void EncodeAliases(const ValueAliases& aliases,
                   google::protobuf::RepeatedPtrField<v1::ValueAlias>* message) {
  for (const auto& [word, labels] : aliases) {
    v1::ValueAlias* alias = message->Add();
    alias->set_alias(word);
    for (const std::string& label : labels) alias->add_labels(label);
  }
}

absl::StatusOr<ValueAliases> DecodeAliases(
    absl::string_view field, const google::protobuf::RepeatedPtrField<v1::ValueAlias>& message) {
  ValueAliases aliases;
  for (int i = 0; i < message.size(); ++i) {
    if (aliases.contains(message[i].alias())) {
      return InvalidField(absl::StrCat(field, "[", i, "].alias"), "stands there twice");
    }
    aliases.insert_or_assign(message[i].alias(),
                             {message[i].labels().begin(), message[i].labels().end()});
  }
  return aliases;
}

void EncodeLayerSpec(const LayerSpec& spec, v1::Layer* message) {
  message->set_name(spec.name);
  message->set_kind(EncodeLayerKind(spec.kind));
  message->set_frame_id(spec.frame_id);
  if (spec.grid) EncodeGridGeometry(*spec.grid, message->mutable_grid());
  if (spec.kind == LayerKind::kOccupancy) {
    message->mutable_thresholds()->set_free_below(spec.thresholds.free_below);
    message->mutable_thresholds()->set_occupied_above(spec.thresholds.occupied_above);
  }
  if (spec.kind == LayerKind::kExploration) {
    message->set_explored_rule(EncodeCellRule(spec.explored_rule));
  }
  message->set_unit(spec.unit);
  EncodeAliases(spec.aliases, message->mutable_aliases());
  if (spec.shape_kinds.ContainsAll()) return;
  for (const ShapeKind kind : kAllShapeKinds) {
    if (spec.shape_kinds.Contains(kind)) message->add_shape_kinds(EncodeShapeKind(kind));
  }
}

void EncodeLayerProperties(const LayerProperties& properties, v1::LayerProperties* message) {
  message->set_has_cells(properties.has_cells);
  message->set_has_shapes(properties.has_shapes);
  message->set_unit(properties.unit);
  if (properties.value_range) {
    message->mutable_value_range()->set_min(properties.value_range->min);
    message->mutable_value_range()->set_max(properties.value_range->max);
  }
  for (const std::string& word : properties.words) message->add_words(word);
  message->set_is_binary(properties.is_binary);
  for (const WordOfValue& named : properties.words_of_values) {
    v1::WordOfValue* added = message->add_words_of_values();
    added->set_word(named.word);
    added->set_value(named.value);
  }
}

LayerProperties DecodeLayerProperties(const v1::LayerProperties& message) {
  LayerProperties properties;
  properties.has_cells = message.has_cells();
  properties.has_shapes = message.has_shapes();
  properties.unit = message.unit();
  if (message.has_value_range()) {
    properties.value_range = {message.value_range().min(), message.value_range().max()};
  }
  properties.words = {message.words().begin(), message.words().end()};
  properties.is_binary = message.is_binary();
  for (const v1::WordOfValue& named : message.words_of_values()) {
    properties.words_of_values.push_back({named.word(), named.value()});
  }
  return properties;
}

void EncodeLayer(const DamagedLayer& layer, v1::Layer* message, Revision version) {
  EncodeLayer(*layer.empty, message, version);
  message->set_problem(layer.damage.ToString());
}

void EncodeLayer(const LayerStructure& layer, v1::Layer* message) {
  EncodeLayerSpec(layer.spec, message);
  message->set_version(layer.version);
  message->set_size(layer.extent.num_cells());
  EncodeLayerProperties(PropertiesOf(layer.spec), message->mutable_properties());
  if (!layer.extent.empty()) EncodeCellBox(layer.extent, message->mutable_extent());
}

void EncodeLayer(const Layer& layer, v1::Layer* message, Revision version) {
  const GridLayer* grid = AsGrid(&layer);
  EncodeLayer(LayerStructure{layer.spec(), grid ? grid->extent() : CellBox(), version}, message);
  message->set_size(layer.Size());
}

absl::StatusOr<LayerSpec> DecodeLayerSpec(absl::string_view field, const v1::Layer& message) {
  LayerSpec spec;
  spec.name = message.name();
  HYPERMAP_ASSIGN_OR_RETURN(const LayerKind kind,
                            DecodeLayerKind(absl::StrCat(field, ".kind"), message.kind()));
  spec.kind = kind;
  spec.frame_id = message.frame_id();
  if (message.has_grid()) {
    HYPERMAP_ASSIGN_OR_RETURN(GridGeometry grid,
                              DecodeGridGeometry(absl::StrCat(field, ".grid"), message.grid()));
    spec.grid = grid;
  }
  const v1::OccupancyThresholds& thresholds = message.thresholds();
  if (thresholds.has_free_below()) spec.thresholds.free_below = thresholds.free_below();
  if (thresholds.has_occupied_above()) {
    spec.thresholds.occupied_above = thresholds.occupied_above();
  }
  HYPERMAP_ASSIGN_OR_RETURN(
      const CellRule explored_rule,
      DecodeCellRule(absl::StrCat(field, ".explored_rule"), message.explored_rule()));
  spec.explored_rule = explored_rule;
  spec.unit = message.unit();
  HYPERMAP_ASSIGN_OR_RETURN(ValueAliases aliases,
                            DecodeAliases(absl::StrCat(field, ".aliases"), message.aliases()));
  spec.aliases = std::move(aliases);
  if (message.shape_kinds().empty()) return spec;
  spec.shape_kinds = ShapeKinds({});
  for (int i = 0; i < message.shape_kinds_size(); ++i) {
    HYPERMAP_ASSIGN_OR_RETURN(
        const ShapeKind shape_kind,
        DecodeShapeKind(absl::StrCat(field, ".shape_kinds[", i, "]"), message.shape_kinds(i)));
    spec.shape_kinds.Add(shape_kind);
  }
  return spec;
}

absl::StatusOr<LayerStructure> DecodeLayerStructure(absl::string_view field,
                                                    const v1::Layer& message) {
  HYPERMAP_ASSIGN_OR_RETURN(LayerSpec spec, DecodeLayerSpec(field, message));
  CellBox extent;
  if (message.has_extent()) extent = DecodeCellBox(message.extent());
  return LayerStructure{std::move(spec), extent, message.version()};
}

}  // namespace hypermap::wire
