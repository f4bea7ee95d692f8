#include "map/layers/layer_properties.h"

#include <memory>

#include "map/layers/layer_registry.h"

namespace hypermap {

LayerProperties PropertiesOf(const LayerSpec& spec) {
  LayerProperties properties;
  const std::shared_ptr<const CellDomain> domain = MakeCellDomain(spec);
  if (!domain) {
    properties.has_shapes = true;
    return properties;
  }
  properties.has_cells = true;
  properties.unit = spec.unit;
  properties.value_range = domain->Range();
  properties.words = domain->Words();
  properties.is_binary = domain->IsBinary();
  properties.words_of_values = domain->WordsOfValues();
  return properties;
}

}  // namespace hypermap
