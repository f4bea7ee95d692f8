// Describes the content of a layer to programs that show layers of kinds that they do not know.
#ifndef HYPERMAP_MAP_LAYERS_LAYER_PROPERTIES_H_
#define HYPERMAP_MAP_LAYERS_LAYER_PROPERTIES_H_

#include <optional>
#include <string>
#include <vector>

#include "map/grid/cell_domain.h"
#include "map/layers/layer_spec.h"

namespace hypermap {

struct LayerProperties {
  // True if it is a grid, which answers with values.
  bool has_cells = false;
  // True if it contains objects.
  bool has_shapes = false;
  // The unit of the cells' values; may be empty.
  std::string unit;
  // Range of the cells' values; nullopt: any number.
  std::optional<CellValueRange> value_range;
  // Words that queries for cells may use, such as "free".
  std::vector<std::string> words;
  // True if cells have one of two values only.
  bool is_binary = false;
  // The words that stand for exactly one value, with that value.
  std::vector<WordOfValue> words_of_values;

  friend bool operator==(const LayerProperties&, const LayerProperties&) = default;
};

LayerProperties PropertiesOf(const LayerSpec& spec);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_LAYER_PROPERTIES_H_
