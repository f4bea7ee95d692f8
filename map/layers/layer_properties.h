// What a layer's content is like, for programs that show layers of kinds they do not know.
#ifndef HYPERMAP_MAP_LAYERS_LAYER_PROPERTIES_H_
#define HYPERMAP_MAP_LAYERS_LAYER_PROPERTIES_H_

#include <optional>
#include <string>
#include <vector>

#include "map/grid/cell_domain.h"
#include "map/layers/layer_spec.h"

namespace hypermap {

struct LayerProperties {
  // Whether it has a grid and answers with values.
  bool has_cells = false;
  // Whether it holds objects.
  bool has_shapes = false;
  // The unit of the cells' values; may be empty.
  std::string unit;
  // The cells' values; absent: any number.
  std::optional<CellValueRange> value_range;
  // Words that cells can be asked for, such as "free".
  std::vector<std::string> words;
  // Whether cells hold one of two values.
  bool is_binary = false;

  friend bool operator==(const LayerProperties&, const LayerProperties&) = default;
};

LayerProperties PropertiesOf(const LayerSpec& spec);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_LAYER_PROPERTIES_H_
