// How the cells of a layer are written for people, by the properties of its kind: a new kind of
// grid needs no change here.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_CELL_VALUES_H_
#define HYPERMAP_CLIENT_LIBS_CLI_CELL_VALUES_H_

#include <memory>
#include <string>

#include "map/grid/cell_domain.h"
#include "map/layers/layer_properties.h"
#include "map/layers/layer_spec.h"

namespace hypermap::cli {

// The properties that all layers of the kind have; the unit is empty.
LayerProperties PropertiesOfKind(LayerKind kind);

// Safe to read from many threads.
class CellValues {
 public:
  // Answers tell the kind of a layer; thresholds are the defaults.
  explicit CellValues(LayerKind kind);
  CellValues(const LayerSpec& spec, LayerProperties properties);

  const LayerProperties& properties() const { return properties_; }

  // The word that stands for the value ("explored"); empty when the kind has none.
  std::string Word(double value) const;
  // The word where cells hold one of two values, else the number.
  std::string Describe(double value) const;

 private:
  LayerProperties properties_;
  std::shared_ptr<const CellDomain> domain_;  // null when there are no cells
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_CELL_VALUES_H_
