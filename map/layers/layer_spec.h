// What a layer is, apart from its content.
#ifndef HYPERMAP_MAP_LAYERS_LAYER_SPEC_H_
#define HYPERMAP_MAP_LAYERS_LAYER_SPEC_H_

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "map/geometry/shape.h"
#include "map/grid/cell_rule.h"
#include "map/grid/grid_geometry.h"
#include "map/values/value_aliases.h"

namespace hypermap {

// The kinds a layer can be of. A new kind: a line here, one in layer_registry.cc, its file pair in
// this folder, its storage codec and its wire name.
enum class LayerKind { kOccupancy, kExploration, kSemantic, kScalar };

// "occupancy", "exploration", "semantic", "scalar".
absl::string_view LayerKindName(LayerKind kind);
std::optional<LayerKind> ParseLayerKind(absl::string_view name);

// "centre", "covered", "touched".
absl::string_view CellRuleName(CellRule rule);
std::optional<CellRule> ParseCellRule(absl::string_view name);

// Which probabilities of an occupancy layer are called free (p < free_below) and occupied
// (p > occupied_above). Both strict; what lies between is neither. Defaults are ROS map_server's.
struct OccupancyThresholds {
  double free_below = 0.196;
  double occupied_above = 0.65;

  friend bool operator==(const OccupancyThresholds&, const OccupancyThresholds&) = default;
};

struct LayerSpec {
  // Unique in its map: letters, digits, '_', '-', '.'; 1 to 63 characters, beginning with a letter
  // or digit.
  std::string name;
  LayerKind kind = LayerKind::kSemantic;
  // The frame of the layer's coordinates.
  std::string frame_id;
  // For the grid kinds: where the cells lie in the layer's frame. Absent for kSemantic.
  std::optional<GridGeometry> grid;
  // For kOccupancy.
  OccupancyThresholds thresholds;
  // For kExploration: which cells what observations saw to be free makes explored.
  CellRule explored_rule = CellRule::kCentre;
  // For kScalar: the unit of the values, free text ("dBm", "degC"); may be empty.
  std::string unit;
  // For kSemantic: other words for its labels, folded.
  ValueAliases aliases;
  // For kSemantic: which kinds of shape its objects may have; at least one.
  ShapeKinds shape_kinds;

  friend bool operator==(const LayerSpec&, const LayerSpec&) = default;
};

// INVALID_ARGUMENT naming the field that is wrong.
absl::Status Validate(const LayerSpec& spec);

// Names of maps, layers and frames: see LayerSpec::name; frames may also hold '/'.
absl::Status ValidateName(absl::string_view field, absl::string_view name);
absl::Status ValidateFrameId(absl::string_view field, absl::string_view frame_id);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_LAYER_SPEC_H_
