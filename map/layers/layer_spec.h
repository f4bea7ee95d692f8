// The specification of a layer, without its content.
#ifndef HYPERMAP_MAP_LAYERS_LAYER_SPEC_H_
#define HYPERMAP_MAP_LAYERS_LAYER_SPEC_H_

#include <cstddef>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "map/geometry/shape.h"
#include "map/grid/cell_rule.h"
#include "map/grid/grid_geometry.h"
#include "map/values/value_aliases.h"

namespace hypermap {

// The kinds of layers. A new kind needs a value here, a line in layer_registry.cc, its pair of
// files in this folder, its storage codec and its wire name.
enum class LayerKind { kOccupancy, kExploration, kSemantic, kScalar };

// Returns "occupancy", "exploration", "semantic" or "scalar".
absl::string_view LayerKindName(LayerKind kind);
std::optional<LayerKind> ParseLayerKind(absl::string_view name);

// Returns "centre", "covered" or "touched".
absl::string_view CellRuleName(CellRule rule);
std::optional<CellRule> ParseCellRule(absl::string_view name);

// The probabilities of an occupancy layer that count as free (p < free_below) and as occupied (p >
// occupied_above). Both bounds are exclusive; values between them are neither. The defaults are
// those of ROS map_server.
struct OccupancyThresholds {
  double free_below = 0.196;
  double occupied_above = 0.65;

  friend bool operator==(const OccupancyThresholds&, const OccupancyThresholds&) = default;
};

// Characters of the name of a map, a layer or a frame.
inline constexpr size_t kMaxNameLength = 63;

struct LayerSpec {
  // Unique in its map: 1 to kMaxNameLength characters out of letters, digits, '_', '-' and '.',
  // beginning with a letter or digit.
  std::string name;
  LayerKind kind = LayerKind::kSemantic;
  // The frame of the layer's coordinates.
  std::string frame_id;
  // For the grid kinds: the position of the cells in the layer's frame. nullopt for kSemantic.
  std::optional<GridGeometry> grid;
  // For kOccupancy.
  OccupancyThresholds thresholds;
  // For kExploration: the rule by which free space in an observation selects the cells that become
  // explored.
  CellRule explored_rule = CellRule::kCentre;
  // For kScalar: the unit of the values, free text ("dBm", "degC"); may be empty.
  std::string unit;
  // For kSemantic: additional words for its labels, folded.
  ValueAliases aliases;
  // For kSemantic: the kinds of shapes that its objects may have; at least one.
  ShapeKinds shape_kinds;

  friend bool operator==(const LayerSpec&, const LayerSpec&) = default;
};

// Returns INVALID_ARGUMENT naming the field that is wrong.
absl::Status Validate(const LayerSpec& spec);

// Validates names of maps, layers and frames: see LayerSpec::name. Frames may also contain '/'.
absl::Status ValidateName(absl::string_view field, absl::string_view name);
absl::Status ValidateFrameId(absl::string_view field, absl::string_view frame_id);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_LAYER_SPEC_H_
