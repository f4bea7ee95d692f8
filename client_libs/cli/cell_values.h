// Formats the cells of a layer for people, by the properties of its kind, so that a new kind of
// grid needs no change here.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_CELL_VALUES_H_
#define HYPERMAP_CLIENT_LIBS_CLI_CELL_VALUES_H_

#include <memory>
#include <string>

#include "map/grid/cell_domain.h"
#include "map/layers/layer_properties.h"
#include "map/layers/layer_spec.h"

namespace hypermap::cli {

// The properties that all layers of the kind have. The unit is empty.
LayerProperties PropertiesOfKind(LayerKind kind);

// Safe to read from many threads.
class CellValues {
 public:
  // For answers, which name only the kind of a layer. The thresholds are the defaults.
  explicit CellValues(LayerKind kind);
  CellValues(const LayerSpec& spec, LayerProperties properties);

  const LayerProperties& properties() const { return properties_; }

  // Returns the word that stands for the value ("explored"); empty if the kind has none.
  std::string Word(double value) const;
  // Returns the word if cells hold one of two values, otherwise the number.
  std::string Describe(double value) const;

 private:
  LayerProperties properties_;
  std::shared_ptr<const CellDomain> domain_;  // null if the layer has no cells
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_CELL_VALUES_H_
